// What moves and who says so: the ARMED switch, STOP ALL while it holds, and what is under way with its Abort.
import { abort, arm, authority, dismissFound, release } from "../logic/authority";
import { online, stopAll, welcome } from "../logic/app";
import { link } from "../logic/app";
import type { Doubt, MotionShape } from "../wire";
import { Icon } from "../widgets/icons";
import { offline, unless } from "../logic/hindrance";

const KINDS: Record<MotionShape["kind"], string> = {
    jog: "is turned by hand",
    profile: "measures its load profile",
    search: "searches its reference",
    zero: "is being zeroed",
    go: "goes to a coordinate",
    turn: "turns",
    store: "Parameters are being stored",
    restore: "Parameters are being restored",
};

const motorsText = (motors: number[]): string =>
    motors.length === 1 ? `Motor ${motors[0]}` : `Motors ${motors.join(", ")}`;
const motionText = (motion: MotionShape): string =>
    `${motion.motors.length ? `${motorsText(motion.motors)} ` : ""}${KINDS[motion.kind]}`;
const doubtText = ({ motor, why }: Doubt): string => `${motor < 0 ? "the program" : `motor ${motor}`} (${why})`;

/** Nothing of a real module moves before this is on. */
export function ArmedSwitch() {
    const { real, armed } = authority.value;
    if (!real) return null;
    const title = armed
        ? "Motors 0, 1 and 2 may be moved from here; a click disarms and stops what this IDE moves"
        : "Nothing is moved from here; a click allows it for motors 0, 1 and 2";
    return (
        <button
            class={`armed ${armed ? "on" : ""}`}
            role="switch"
            aria-checked={armed}
            aria-label="ARMED: motors 0, 1 and 2 may move"
            {...unless(offline.value || (!link.value.up && "The module does not answer"), title)}
            onClick={() => arm(!armed)}
        >
            <Icon name={armed ? "alert" : "power"} size={13} /> {armed ? "ARMED" : "Not armed"}{" "}
            <span class="motors">motors 0 1 2</span>
        </button>
    );
}

/** Strips under the tool bar: STOP ALL while it holds, motors found turning, motions under way. */
export function MotionStrips() {
    const { latched, doubts, motions, found } = authority.value;
    if (!online.value) return null;
    return (
        <>
            {latched && (
                <div class="banner stop" role="alert">
                    <Icon name="stop" />
                    <span>
                        {doubts.length
                            ? `STOP ALL. Not confirmed: ${doubts.map(doubtText).join(", ")}. The IDE tries on.`
                            : "STOP ALL holds. The program is stopped, all motors have confirmed that they stand."}
                    </span>
                    <button onClick={release} title="Release STOP ALL: motors may move again">
                        {doubts.length ? "Release all the same" : "Release"}
                    </button>
                </div>
            )}
            {!latched && doubts.length > 0 && motions.length === 0 && (
                <div class="banner" role="status" data-strip="stopping">
                    <Icon name="stop" />
                    <span>Coming to rest: {doubts.map(doubtText).join(", ")}.</span>
                </div>
            )}
            {found && (
                <div class="banner" role="alert">
                    <Icon name="alert" />
                    <span>{found}</span>
                    <button class="danger" onClick={stopAll}>
                        STOP ALL
                    </button>
                    <button onClick={dismissFound}>Leave it</button>
                </div>
            )}
            {motions
                .filter(motion => motion.kind !== "jog")
                .map(motion => (
                    <div key={motion.number} class="banner motion" role="status">
                        <Icon name="play" />
                        <span>
                            {motionText(motion)}
                            {motion.window === welcome.value?.window ? "" : ", for another window"}.
                        </span>
                        <button onClick={() => abort(motion.number)}>Abort</button>
                    </div>
                ))}
        </>
    );
}
