// The page behind the QR code: the command for a camera's machine. Its token is in the address after `#`.
import { commandFor } from "./camera_command.js";
import { byId } from "../base/dom.js";

byId("command").replaceChildren(...commandFor({ server: location.origin, token: location.hash.slice(1) }));
