/** The page that shows the documentation, or says how to build it, on a server where its site has not been built. */

import { navigation } from "../shared/page.js";

navigation("help");
