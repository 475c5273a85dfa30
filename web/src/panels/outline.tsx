// Outline and map of the program in front: labels, routines with stack and times, user variables with their lines.
import { useEffect } from "preact/hooks";
import { program, tables } from "../logic/app";
import { coverage, coverageSource, coveredCount } from "../logic/coverage";
import { openFile } from "../logic/documents";
import { flowMap, flowWanted, nothing } from "../logic/flow";
import { loaded } from "../logic/app";
import { short } from "../logic/units";
import type { FlowMap, RoutineShape, Site } from "../wire";
import { Empty } from "../widgets/basics";

const LONG_MS = 50;
/** More sites of a variable than this are folded into a number. */
const MANY_SITES = 12;

export function Outline() {
    useEffect(() => {
        flowWanted.value++;
        return () => void flowWanted.value--;
    }, []);
    const found = flowMap.value;
    if (!found)
        return (
            <Empty icon="list" title="No outline">
                {nothing.value}
            </Empty>
        );
    return (
        <div class="outline">
            <Summary found={found} />
            <Labels found={found} />
            <h4>Routines</h4>
            <div class="scroll-x" tabIndex={0} role="region" aria-label="Routines">
                <table class="routines">
                    <thead>
                        <tr>
                            <th scope="col">routine</th>
                            <th scope="col" title="Instructions without those of routines that it calls">
                                size
                            </th>
                            <th
                                scope="col"
                                title="The longest path without a WAIT, in this routine and those that it calls"
                            >
                                between WAITs
                            </th>
                            <th scope="col">calls</th>
                        </tr>
                    </thead>
                    <tbody>
                        {found.routines.map(row => (
                            <Routine key={row.name} row={row} found={found} />
                        ))}
                    </tbody>
                </table>
            </div>
            <Variables found={found} />
        </div>
    );
}

function Summary({ found }: { found: FlowMap }) {
    const { executed, total } = coveredCount.value;
    return (
        <dl class="summary">
            <div>
                <dt>instructions</dt>
                <dd>
                    {found.instructions} of {tables.value.program_size}
                </dd>
            </div>
            <div>
                <dt title="The greatest number of open CSUBs, recursion aside">stack</dt>
                <dd>
                    {found.stack} of {tables.value.stack_depth}
                </dd>
            </div>
            {coverage.value && (
                <div>
                    <dt title={coverageSource.value}>executed</dt>
                    <dd>
                        {executed} of {total}
                    </dd>
                </div>
            )}
        </dl>
    );
}

const Place = ({ site, children }: { site: Site; children: preact.ComponentChildren }) => (
    <button class="link" title={`${site.path}:${site.line}`} onClick={() => openFile(site.path, site.line)}>
        {children}
    </button>
);

function Labels({ found }: { found: FlowMap }) {
    const here = loaded.value?.path === found.path ? program.value.counter : -1;
    const current = found.labels.filter(label => label.address <= here).pop();
    return (
        <>
            <h4>Labels</h4>
            {found.labels.length ? (
                <ul class="labels">
                    {found.labels.map(label => (
                        <li key={label.name} class={label === current ? "now" : ""}>
                            <Place site={label}>{label.name}</Place>
                            <span class="muted">
                                {label.path === found.path ? "" : `${label.path}:`}
                                {label.line}
                            </span>
                            <span class="address">{label.address}</span>
                        </li>
                    ))}
                </ul>
            ) : (
                <p class="muted note">The program has no labels.</p>
            )}
        </>
    );
}

function Routine({ row, found }: { row: RoutineShape; found: FlowMap }) {
    return (
        <tr>
            <th scope="row">
                <Place site={row}>{row.name}</Place>
            </th>
            <td class="value">{row.instructions}</td>
            <td class={row.ms === null || row.ms > LONG_MS ? "warn" : ""}>
                {row.ms === null
                    ? "a loop without a WAIT"
                    : `${row.longest} ${row.longest === 1 ? "instruction" : "instructions"}, ${short(row.ms)} ms`}
            </td>
            <td>
                {row.calls.map((name, at) => {
                    const called = found.routines.find(other => other.name === name);
                    return (
                        <span key={name}>
                            {at > 0 && ", "}
                            {called ? <Place site={called}>{name}</Place> : name}
                        </span>
                    );
                })}
            </td>
        </tr>
    );
}

function Sites({ sites, found }: { sites: Site[]; found: FlowMap }) {
    if (!sites.length) return <span class="muted">nowhere</span>;
    return (
        <>
            {sites.slice(0, MANY_SITES).map((site, at) => (
                <span key={`${site.path}:${site.line}`}>
                    {at > 0 && ", "}
                    <Place site={site}>
                        {site.path === found.path ? "" : `${site.path}:`}
                        {site.line}
                    </Place>
                </span>
            ))}
            {sites.length > MANY_SITES && ` and ${sites.length - MANY_SITES} more`}
        </>
    );
}

function Variables({ found }: { found: FlowMap }) {
    if (!found.variables.length) return null;
    return (
        <>
            <h4>User variables</h4>
            <table class="variable-uses">
                <thead>
                    <tr>
                        <th scope="col">number</th>
                        <th scope="col">written in lines</th>
                        <th scope="col">read in lines</th>
                    </tr>
                </thead>
                <tbody>
                    {found.variables.map(row => (
                        <tr key={row.number}>
                            <th scope="row">{row.number}</th>
                            <td>
                                <Sites sites={row.writers} found={found} />
                            </td>
                            <td>
                                <Sites sites={row.readers} found={found} />
                            </td>
                        </tr>
                    ))}
                </tbody>
            </table>
        </>
    );
}
