// Observations over time on the page of a program: a table with a row for each instant.
//
// In: the columns of a question over time, and what a reader sets. Out: elements of the page; the rows of `shownPage`.
// Invariant: a row has a number for each column, or null where nothing is observed.

/** The most values of an observation that are listed in a menu. */
const MOST_LISTED = 60;

/** The observations over time that a reader has made of these columns before, or the first ones. */
function firstInstants({ columns, count }, observed) {
    if (observed !== null && JSON.stringify(observed.columns) === JSON.stringify(columns)) {
        return observed.rows;
    }
    return Array.from({ length: count }, () => Object.fromEntries(columns.map((one) => [one.name, one.value])));
}

/** The observations to which the answer of a page without a server belongs. */
function fixedInstants({ instants }) {
    if (instants === null) {
        return "";
    }
    const values = instants.columns.map((one) => `${one.label} = ${one.names ? one.names[one.numbers.indexOf(one.value)] : one.value}`);
    return ` The answer is that to ${instants.count} instants${values.length === 0 ? "" : `, each with ${values.join(", ")}`}.`;
}

/** The table of observations over time, a row for each instant. */
function observations(columns) {
    const rows = shownPage.instants;
    const head = element("tr", {}, element("th", { scope: "col" }, "t"), ...columns.map((one) => element("th", { scope: "col" }, one.label)));
    const body = element("tbody");
    const grow = element("button", { type: "button", id: "grow" }, "Add an instant");
    const shrink = element("button", { type: "button", id: "shrink" }, "Remove the last");
    const line = (row, at) =>
        element("tr", {}, element("th", { scope: "row" }, String(at + 1)), ...columns.map((one) => element("td", {}, observation(one, row, at + 1))));
    const tell = () => {
        shrink.disabled = rows.length < 2;
        refresh();
    };
    body.append(...rows.map(line));
    shrink.disabled = rows.length < 2;
    grow.addEventListener("click", () => {
        rows.push({ ...rows[rows.length - 1] });
        body.append(line(rows[rows.length - 1], rows.length - 1));
        tell();
    });
    shrink.addEventListener("click", () => {
        rows.pop();
        body.lastElementChild.remove();
        tell();
    });
    const table = element("table", {}, element("thead", {}, head), body);
    const place = element("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": "Observations" }, table);
    return element("fieldset", { id: "observations" }, element("legend", {}, "Observations"), place, element("p", {}, grow, " ", shrink));
}

/** The element of one observation at an instant; empty, it is not observed. */
function observation(one, row, instant) {
    const name = `${one.label} at ${instant}`;
    if (one.kind === "number" || one.numbers.length > MOST_LISTED) {
        const box = element("input", { type: "number", step: one.whole ? "1" : "any", "aria-label": name, placeholder: "none" });
        box.value = row[one.name] === null ? "" : String(row[one.name]);
        box.addEventListener("input", () => {
            row[one.name] = box.value === "" ? null : Number(box.value);
            refresh();
        });
        return box;
    }
    const items = one.names.map((value, place) => element("option", { value: String(place) }, value));
    const menu = element("select", { "aria-label": name }, element("option", { value: "" }, "none"), ...items);
    menu.value = row[one.name] === null ? "" : String(one.numbers.indexOf(row[one.name]));
    menu.addEventListener("input", () => {
        row[one.name] = menu.value === "" ? null : one.numbers[Number(menu.value)];
        refresh();
    });
    return menu;
}
