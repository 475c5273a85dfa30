// The three axes.
import { welcome } from "../logic/app";
import { Empty } from "../widgets/basics";
import { AxisCard } from "./axes/card";

export function Axes() {
    if (!welcome.value)
        return (
            <Empty icon="plug" title="No module yet">
                Waiting for the IDE's server.
            </Empty>
        );
    return (
        <div class="axes">
            {[0, 1, 2].map(motor => (
                <AxisCard key={motor} motor={motor} />
            ))}
        </div>
    );
}
