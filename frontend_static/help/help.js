/** The page that shows the documentation, or says how to build it, on a server where its site has not been built. */

import { part } from "../shared/dom.js";
import { navigation } from "../shared/page.js";
import { themeButton } from "../shared/theme.js";

navigation("help");
part("tools").append(themeButton());
