// The load profile: measured by the server, drawn here.
import { rangeOf } from "../../logic/scales";
import { ask, welcome } from "../../logic/app";
import { abort, motionOf, notReady, profilePoints } from "../../logic/authority";
import { remembered } from "../../logic/settings";
import { offer } from "../../widgets/basics";
import { LocalNumber } from "../../widgets/fields";
import { Icon } from "../../widgets/icons";
import { MotorChoice, NoDrivers, motor } from "./common";
import { unless } from "../../logic/hindrance";

const range = remembered<{ low: number | null; high: number | null; step: number | null }>("profile", {
    low: 50,
    high: 1000,
    step: 50,
});

export function Profile() {
    if (!welcome.value!.model.drivers) return <NoDrivers />;
    const { low, high, step } = range.value;
    const points = profilePoints.value;
    const running = motionOf("profile");
    const fits = low !== null && high !== null && step !== null && low <= high;
    const measure = async () => {
        if (!fits) return;
        profilePoints.value = [];
        await ask({ call: "profile", motor: motor.value, low, high, step });
    };
    const place = (value: number) => 40 + ((value - (low ?? 0)) / Math.max(1, (high ?? 0) - (low ?? 0))) * 640;
    const tone = (deviation: number) =>
        deviation < 0.4 ? "var(--good)" : deviation < 1 ? "var(--warn)" : "var(--bad)";
    const set = (part: Partial<typeof range.value>) => (range.value = { ...range.value, ...part });
    return (
        <div class="tool-body">
            <div class="row">
                <MotorChoice />
            </div>
            <div class="grid">
                <label>
                    From velocity
                    <LocalNumber
                        value={low}
                        low={1}
                        high={rangeOf("max_speed").high}
                        label="From velocity"
                        onInput={value => set({ low: value })}
                    />
                </label>
                <label>
                    To velocity
                    <LocalNumber
                        value={high}
                        low={1}
                        high={rangeOf("max_speed").high}
                        label="To velocity"
                        onInput={value => set({ high: value })}
                    />
                </label>
                <label>
                    Step
                    <LocalNumber value={step} low={1} high={500} label="Step" onInput={value => set({ step: value })} />
                </label>
            </div>
            <div class="row">
                {running ? (
                    <button class="primary" onClick={() => abort(running.number)}>
                        Abort
                    </button>
                ) : (
                    <button
                        class="primary"
                        {...unless(notReady.value || (!fits && "Velocities rise from the first to the last"))}
                        onClick={measure}
                    >
                        Measure
                    </button>
                )}
                {points.length > 0 && (
                    <button
                        onClick={() =>
                            offer(
                                "load-profile.csv",
                                `${[
                                    "velocity,mean_load,deviation",
                                    ...points.map(
                                        point =>
                                            `${point.velocity},${point.mean.toFixed(2)},${point.deviation.toFixed(3)}`,
                                    ),
                                ].join("\n")}\n`,
                            )
                        }
                    >
                        <Icon name="save" /> Export CSV
                    </button>
                )}
                <span class="muted">ten samples at each velocity; green is steady, red is not</span>
            </div>
            <svg class="profile-chart" viewBox="0 0 700 230" role="img" aria-label="Load over velocity">
                {[0, 1, 2, 3, 4, 5, 6, 7].map(n => (
                    <g key={n}>
                        <path class="grid" d={`M40 ${200 - n * 25}H690`} />
                        <text x="30" y={204 - n * 25} text-anchor="end">
                            {n}
                        </text>
                    </g>
                ))}
                {points.map(point => (
                    <g key={point.velocity} stroke={tone(point.deviation)} fill={tone(point.deviation)}>
                        <path
                            d={`M${place(point.velocity)} ${200 - (point.mean - point.deviation) * 25}V${200 - (point.mean + point.deviation) * 25}`}
                            stroke-width="2"
                        />
                        <circle cx={place(point.velocity)} cy={200 - point.mean * 25} r="4" />
                    </g>
                ))}
                <text x="40" y="222">
                    {low}
                </text>
                <text x="680" y="222" text-anchor="end">
                    {high} velocity units
                </text>
            </svg>
        </div>
    );
}
