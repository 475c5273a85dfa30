// Opens the page, and its connection to the server.
import { effect } from "@preact/signals";
import { render } from "preact";
import { shownTheme } from "./logic/theme";
import { connection, loaded, welcome } from "./logic/app";
import "./logic/events";
import { openFile, restore } from "./logic/documents";
import { Page } from "./shell/page";

let restored = false;
effect(() => {
    if (!welcome.value || restored) return;
    restored = true;
    void restore();
});
void shownTheme;
void [openFile, loaded];
const root = document.getElementById("page")!;
root.replaceChildren();
render(<Page />, root);
connection.open();
