// Runs before the first paint, so that the page does not flash in the other theme.
try {
    const theme = JSON.parse(localStorage.getItem("tmcm34x.theme"));
    const light = matchMedia("(prefers-color-scheme: light)").matches;
    document.documentElement.dataset.theme = theme || (light ? "light" : "dark");
} catch {
    // Without a store the page keeps its default theme.
}
