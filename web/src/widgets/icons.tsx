// Icons, drawn on a grid of 16.
const PATHS: Record<string, string> = {
    play: "M4.5 2.8v10.4a.6.6 0 0 0 .9.5l8.2-5.2a.6.6 0 0 0 0-1L5.4 2.3a.6.6 0 0 0-.9.5Z|fill",
    stop: "M4 3.2h8a.8.8 0 0 1 .8.8v8a.8.8 0 0 1-.8.8H4a.8.8 0 0 1-.8-.8V4a.8.8 0 0 1 .8-.8Z|fill",
    pause: "M4.3 3h2.4v10H4.3zM9.3 3h2.4v10H9.3z|fill",
    continue: "M2.8 3v10M6 3.4v9.2a.5.5 0 0 0 .8.4l6.6-4.6a.5.5 0 0 0 0-.8L6.8 3a.5.5 0 0 0-.8.4Z",
    step: "M2.5 8h7M6.5 5 9.7 8l-3.2 3M12.2 8a1.1 1.1 0 1 0 2.2 0 1.1 1.1 0 1 0-2.2 0Z",
    "step-over": "M2.5 9a5.5 5.5 0 0 1 10.6-2M13.4 3.2V7H9.6M6.6 12.5a1.4 1.4 0 1 0 2.8 0 1.4 1.4 0 1 0-2.8 0Z",
    "step-out": "M8 10V2.6M4.8 5.6 8 2.4l3.2 3.2M4 13h8",
    reset: "M3.5 3v10M12.8 3.6v8.8L6 8Z",
    breakpoint: "M8 3.5a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9Z|fill",
    assemble: "M3 4.5h10M3 8h6M3 11.5h4M10.5 11l1.6 1.6 2.6-3.4",
    download: "M8 2v7.5M4.8 6.5 8 9.7l3.2-3.2M2.8 10.5V13h10.4v-2.5",
    upload: "M8 9.7V2.3M4.8 5.3 8 2.1l3.2 3.2M2.8 10.5V13h10.4v-2.5",
    plus: "M8 3v10M3 8h10",
    bolt: "M9 1.800 3.500 9H8l-1 5.200L12.500 7H8Z",
    minus: "M3 8h10",
    close: "M4 4l8 8M12 4l-8 8",
    search: "M7 2.8a4.2 4.2 0 1 0 0 8.4 4.2 4.2 0 0 0 0-8.4ZM10.2 10.2l3.4 3.4",
    save: "M3 3h8l2 2v8H3zM5.5 3v3h5V3M5.5 13V9h5v4",
    file: "M4 2h5l3 3v9H4zM9 2v3h3",
    folder: "M2 4h4l1.4 1.6H14V13H2z",
    alert: "M8 2.4 14.4 13H1.6ZM8 6.4v3.2M8 11.3v.2",
    check: "M3 8.4l3.4 3.4L13 5",
    info: "M8 2a6 6 0 1 0 0 12A6 6 0 0 0 8 2ZM8 7.2v4M8 4.8v.2",
    help: "M8 2a6 6 0 1 0 0 12A6 6 0 0 0 8 2ZM6.2 6.3a1.8 1.8 0 1 1 2.6 1.6c-.6.3-.8.7-.8 1.3M8 11.2v.2",
    theme: "M8 2a6 6 0 1 0 0 12A6 6 0 0 0 8 2Z|M8 2a6 6 0 0 1 0 12Z|fill",
    left: "M9.8 3.5 5.2 8l4.6 4.5",
    right: "M6.2 3.5 10.8 8l-4.6 4.5",
    up: "M3.5 9.8 8 5.2l4.5 4.6",
    down: "M3.5 6.2 8 10.8l4.5-4.6",
    turnLeft: "M5.4 2.6 2.6 5.4l2.8 2.8M2.8 5.4h6a4 4 0 1 1 0 8H5",
    turnRight: "M10.6 2.6l2.8 2.8-2.8 2.8M13.2 5.4h-6a4 4 0 1 0 0 8H11",
    jogLeft: "M11.600 3.100v9.800a.6.6 0 0 1-.9.500L3.200 8.500a.6.6 0 0 1 0-1l7.500-4.900a.6.6 0 0 1 .9.500Z|fill",
    jogRight: "M4.400 3.100v9.800a.6.6 0 0 0 .9.500l7.500-4.900a.6.6 0 0 0 0-1L5.300 2.600a.6.6 0 0 0-.9.500Z|fill",
    menu: "M2.500 4.500h11M2.500 8h11M2.500 11.500h11",
    more: "M3.200 8h.1M8 8h.1M12.800 8h.1",
    home: "M2.6 7.6 8 3l5.4 4.6M4.2 6.6V13h7.6V6.6M8 13V9.6",
    plug: "M5.5 2v3.5M10.5 2v3.5M4 5.5h8v2a4 4 0 0 1-8 0zM8 11.5V14",
    power: "M8 2v6M4.6 4.2a5 5 0 1 0 6.8 0",
    expand: "M9.5 3H13v3.5M6.5 13H3V9.5M13 3 9 7M3 13l4-4",
    copy: "M5.5 5.5h7v7h-7zM3.5 10.5v-7h7",
    filter: "M2.5 3.5h11L9.4 8.4v4.2l-2.8 1V8.4z",
    trash: "M3 4.5h10M6 4.5V3h4v1.5M4.5 4.5l.6 8.5h5.8l.6-8.5M7 7v4M9 7v4",
    star: "M8 2.4l1.7 3.5 3.9.5-2.8 2.7.7 3.8L8 11.1l-3.5 1.8.7-3.8L2.4 6.4l3.9-.5z",
    undo: "M6 3 3 6l3 3M3.2 6h5.6a3.6 3.6 0 1 1 0 7.2H6",
    table: "M2.5 3h11v10h-11zM2.5 6.3h11M2.5 9.6h11M6.5 3v10",
    tools: "M9.6 3.2a3.3 3.3 0 0 0-.5 4L3 13.2l-.2-.2M9.6 3.2l1.9 1.9 1.9-1.9M13.4 3.2a3.3 3.3 0 0 1-4.3 4L3.6 12.6",
    list: "M5.5 4h8M5.5 8h8M5.5 12h8M2.5 4h.6M2.5 8h.6M2.5 12h.6",
    follow: "M2.500 4h11M2.500 12h6M2.500 8h6.500M7 5.500 9.500 8 7 10.500M12 7v2",
    columns: "M2.500 3h11v10h-11zM8 3v10M4.500 6h1.500M10 6h1.500M4.500 9h1.500M10 9h1.500",
    wave: "M2 8c1.5-6 3-6 4.5 0s3 6 4.5 0S13.500 3.500 14 4",
};

export function Icon({ name, size = 16 }: { name: string; size?: number }) {
    const parts = (PATHS[name] ?? "").split("|");
    return (
        <svg class="icon" width={size} height={size} viewBox="0 0 16 16" aria-hidden="true">
            {parts
                .filter(part => part !== "fill")
                .map((path, n) => (
                    <path key={n} d={path} class={parts[n + 1] === "fill" ? "fill" : ""} />
                ))}
        </svg>
    );
}
