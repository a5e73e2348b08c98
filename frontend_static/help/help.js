/** The page for the documentation's text, or for how to build it, on a server without the built site. */

import { navigation } from "../shared/page.js";

navigation("help");
