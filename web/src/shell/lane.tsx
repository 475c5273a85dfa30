// The line below the tool bar.
import { welcome } from "../logic/app";
import { openPage } from "../logic/documents";
import { place } from "../logic/modules";
import { ArmedSwitch, MotionStrips } from "../panels/motion";
import { Banner, Notices } from "../panels/overlays";
import { PastStrip } from "../panels/past";

/** Where the module is, what holds, and the last messages: one line of a fixed height, so that nothing is shifted or covered. */
export const Lane = () => (
    <div class="lane" role="region" aria-label="State">
        {welcome.value && (
            <button class="place" title="Connection: this module, and others" onClick={() => openPage("connection")}>
                <span>{place.value}</span>
            </button>
        )}
        <ArmedSwitch />
        <PastStrip />
        <Banner />
        <MotionStrips />
        <span class="gap" />
        <Notices />
    </div>
);
