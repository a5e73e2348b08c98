/** The page that stands where the documentation would be, on a server where it has not been built. */

import { part } from "../shared/dom.js";
import { navigation } from "../shared/navigation.js";
import { themeButton } from "../shared/theme.js";

navigation("help");
part("tools").append(themeButton());
