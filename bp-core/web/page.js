// The page of a program: controls, answers that follow them, the derivation, the figure.
//
// In: a program as the compiler describes it, and the functions of its questions. Out: the page. Invariant: text from a
// program is text, never markup; the answers on the page are those of the values that the controls show.

const byId = (id) => document.getElementById(id);

/** An element with attributes and children; children that are strings become text. */
function element(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
        made.setAttribute(key, value);
    }
    made.append(...children);
    return made;
}

/** The program that is shown, the functions of its questions, and where other questions are asked. */
const shownPage = { program: null, functions: {}, elsewhere: null, values: {}, instants: [], question: 0, pending: 0, asked: null };

/**
 * Shows a program. `elsewhere(question, given, signal)` answers a question that has no function, given the values of its
 * controls and its observations over time; it may be null.
 */
function show(program, functions, elsewhere) {
    const before = shownPage.program?.questions[shownPage.question];
    const moved = before === undefined ? [] : before.controls.filter((one) => shownPage.values[one.name] !== one.value);
    const set = moved.map((one) => [one, shownPage.values[one.name]]);
    const observed = { columns: before?.instants?.columns, rows: shownPage.instants };
    forget();
    Object.assign(shownPage, { program, functions, elsewhere });
    document.title = program.name;
    byId("title").textContent = program.name;
    byId("documentation").textContent = program.documentation;
    byId("figure").innerHTML = program.figure;
    byId("text").textContent = program.text;
    const file = new Blob([program.text], { type: "text/plain" });
    URL.revokeObjectURL(byId("download").href);
    byId("download").href = URL.createObjectURL(file);
    byId("download").download = `${program.file}.bp`;
    const names = program.questions.map((question) => (question.name ? `${question.name}: ${question.text}` : question.text));
    byId("question").replaceChildren(...names.map((name, at) => element("option", { value: String(at) }, name)));
    byId("questions").hidden = names.length === 0;
    const kept = program.questions.findIndex((question) => question.name === before?.name);
    choose(Math.max(kept, 0), kept < 0 ? [] : set, kept < 0 ? null : observed);
}

/** Gives up the answer that is awaited; if it still comes, it is not shown. */
function forget() {
    shownPage.asked?.abort();
    shownPage.asked = null;
    byId("waiting").textContent = "";
    byId("answers").removeAttribute("aria-busy");
}

/** The value that a reader gave to a control of an earlier program, in a control of this one; null if it has none. */
function keptValue(one, set) {
    const [earlier, value] = set.find(([earlier]) => earlier.name === one.name && earlier.kind === one.kind) ?? [];
    // A value that has changed in the text is what the reader wants to see.
    if (earlier === undefined || earlier.value !== one.value) {
        return null;
    }
    if (one.kind === "number") {
        return one.whole && !Number.isInteger(value) ? null : value;
    }
    const place = one.names.indexOf(earlier.names[earlier.numbers.indexOf(value)]);
    return place < 0 ? null : one.numbers[place];
}

/** Shows a question with its controls at their first values, or at those that a reader has `set` or `observed` before. */
function choose(at, set = [], observed = null) {
    forget();
    shownPage.question = at;
    const question = shownPage.program.questions[at];
    if (question === undefined) {
        byId("answers").replaceChildren();
        byId("controls").replaceChildren();
        return;
    }
    byId("question").value = String(at);
    byId("steps").innerHTML = question.derivation;
    // What is wider than the page is scrolled, also from the keyboard.
    byId("steps").querySelectorAll(".equation").forEach((line) => line.setAttribute("tabindex", "0"));
    shownPage.values = Object.fromEntries(question.controls.map((one) => [one.name, keptValue(one, set) ?? one.value]));
    const isFixed = question.refused !== null && shownPage.elsewhere === null;
    byId("fixed").hidden = !isFixed;
    byId("fixed").textContent = isFixed ? `There are no controls: ${question.refused}.${fixedInstants(question)}` : "";
    const groups = [["Evidence", false], ["Parameters", true]].map(([legend, isParameter]) => {
        const own = question.controls.filter((control) => control.is_parameter === isParameter);
        return own.length === 0 || isFixed ? null : element("fieldset", {}, element("legend", {}, legend), ...own.map(control));
    });
    byId("controls").replaceChildren(...groups.filter((group) => group !== null));
    shownPage.instants = question.instants === null ? [] : firstInstants(question.instants, observed);
    if (question.instants !== null && !isFixed) {
        byId("controls").append(observations(question.instants.columns));
    }
    byId("reset").hidden = (question.controls.length === 0 && question.instants === null) || isFixed;
    byId("answers").replaceChildren();
    byId("answers").shown = [];
    refresh();
}

/** The element of a control. */
function control(one, at) {
    const id = `control-${one.is_parameter ? "p" : "e"}${at}`;
    const set = (number) => {
        shownPage.values[one.name] = number;
        refresh();
    };
    const label = element("label", { for: id }, one.label);
    const first = shownPage.values[one.name];
    if (one.kind === "menu") {
        const items = one.names.map((name, place) => element("option", { value: String(place) }, name));
        const menu = element("select", { id }, ...items);
        menu.value = String(one.numbers.indexOf(first));
        menu.addEventListener("input", () => set(one.numbers[Number(menu.value)]));
        return element("div", { class: "control" }, label, menu);
    }
    if (one.kind === "slider") {
        const slider = element("input", { id, type: "range", min: "0", max: String(one.numbers.length - 1), step: "1" });
        const value = element("output", { for: id });
        const tell = () => {
            value.textContent = one.names[Number(slider.value)];
            slider.setAttribute("aria-valuetext", value.textContent);
        };
        slider.value = String(one.numbers.indexOf(first));
        tell();
        slider.addEventListener("input", () => {
            tell();
            set(one.numbers[Number(slider.value)]);
        });
        return element("div", { class: "control" }, label, value, slider);
    }
    const range = { min: String(one.low), max: String(one.high), step: String(one.step) };
    const slider = element("input", { id, type: "range", ...range, step: "any" });
    const box = element("input", { type: "number", step: one.whole ? "1" : "any", "aria-label": `${one.label}, as a number` });
    const wrong = element("p", { class: "error", role: "status" });
    const short = (number) => String(Number(number.toPrecision(12)));
    /** What is wrong with a number; nothing if it can be used. */
    const mistake = (text) => {
        const number = Number(text);
        if (text === "" || !Number.isFinite(number)) {
            return "This is not a number";
        }
        if (one.whole && !Number.isInteger(number)) {
            return "This is not an integer";
        }
        const isBelow = ({ least, is_open: isOpen }) => least !== null && (isOpen ? number <= least : number < least);
        const limit = one.limits.find((limit) => isBelow(limit) || (limit.most !== null && number > limit.most));
        return limit === undefined ? "" : `\`${one.label}\` is ${short(number)}, but it must be ${limit.expected}`;
    };
    /** Shows a number on the slider, whose ends move where it is beyond them. */
    const reach = (number) => {
        slider.min = String(Math.min(Number(slider.min), number));
        slider.max = String(Math.max(Number(slider.max), number));
        slider.value = String(number);
    };
    /** Says what is wrong with the number in the box; nothing if it is used. */
    const tell = (words) => {
        wrong.textContent = words === "" ? "" : `${words}; the answer is that of ${short(shownPage.values[one.name])}.`;
        box.setAttribute("aria-invalid", String(words !== ""));
    };
    reach(first);
    box.value = short(first);
    const use = (number) => {
        box.value = short(number);
        tell("");
        set(number);
    };
    slider.addEventListener("input", () => {
        const steps = Math.round((Number(slider.value) - one.low) / one.step);
        use(Number((one.low + steps * one.step).toPrecision(12)));
    });
    slider.addEventListener("keydown", (event) => {
        // `any` has no step of its own for the arrow keys.
        const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
        if (step !== undefined) {
            event.preventDefault();
            const number = shownPage.values[one.name] + step * one.step;
            slider.value = String(number);
            use(Number(Number(slider.value).toPrecision(12)));
        }
    });
    box.addEventListener("input", () => {
        const words = mistake(box.value);
        tell(words);
        if (words === "") {
            reach(Number(box.value));
            set(Number(box.value));
        }
    });
    return element("div", { class: "control" }, label, box, slider, wrong);
}

/** Computes the answers and shows them, once for each frame. */
function refresh() {
    if (shownPage.pending === 0) {
        shownPage.pending = requestAnimationFrame(() => {
            shownPage.pending = 0;
            performance.clearMeasures("answer");
            const start = performance.now();
            answer();
            performance.measure("answer", { start });
        });
    }
}

function answer() {
    const { program, functions, elsewhere, values, question: at } = shownPage;
    const question = program.questions[at];
    forget();
    if (question.refused === null) {
        try {
            const results = resultsOf(question, functions, values, shownPage.instants);
            draw(question.asks.map((ask) => {
                const whole = picture(ask, results);
                return { text: ask.text, rows: whole ? [] : rows(ask, results), picture: whole, lnEvidence: lnEvidence(ask, results) };
            }));
            return;
        } catch (error) {
            // A server has the words of `bp ask`, and answers more.
            if (elsewhere === null) {
                draw([{ text: question.text, error: withParameters(error.message, question) }]);
                return;
            }
        }
    } else if (elsewhere === null) {
        draw(question.fixed);
        return;
    }
    const asked = new AbortController();
    shownPage.asked = asked;
    byId("waiting").textContent = "Computing …";
    byId("answers").setAttribute("aria-busy", "true");
    // What is not observed at an instant is left out.
    const seen = (row) => Object.fromEntries(Object.entries(row).filter(([, value]) => value !== null));
    elsewhere(at, { values: { ...values }, instants: shownPage.instants.map(seen) }, asked.signal).then((answers) => {
        // Another question may have been asked since, also of another program.
        if (shownPage.asked === asked) {
            forget();
            draw(answers);
        }
    });
}

/** A message about the numbers of forms, with the parameters that a reader has changed. */
function withParameters(message, { controls }) {
    const changed = controls.filter((one) => one.is_parameter && shownPage.values[one.name] !== one.value);
    const told = changed.map((one) => `\`${one.label}\` = ${digits(shownPage.values[one.name])}`).join(", ");
    return message === OUTSIDE && told !== "" ? `${message}, with ${told}` : message;
}

/** A distribution of one or two variables with many values, which is drawn; null for others. */
function picture(ask, results) {
    const [{ left, right, run }] = ask.sources;
    const isOne = right.length === 0 && results[run].each === undefined;
    const isWhole = ask.statistic.word === "" && ask.wanted.length === 0 && ask.bound.length === 0 && isOne;
    return isWhole && left.length <= 2 && combinations(left) > 40 ? { left, numbers: distribution(ask.sources[0], results) } : null;
}

/** What decides whether the elements of an answer are used again. */
function kindOf(answer) {
    return answer.error ? "error" : answer.picture ? "picture" : answer.rows.map((row) => headings(cellsOf(row))).join(" ");
}

/** Shows answers; elements are used again, so that the page stays calm while a control moves. */
function draw(answers) {
    const place = byId("answers");
    const kinds = answers.map((one) => kindOf(one) + one.text);
    if (JSON.stringify(place.shown) !== JSON.stringify(kinds)) {
        place.shown = kinds;
        place.replaceChildren(...answers.map((one) => element("section", { class: "answer" }, element("h3", {}, one.text))));
    }
    answers.forEach((one, at) => {
        const section = place.children[at];
        if (one.error) {
            const line = section.querySelector("p") ?? section.appendChild(element("p", { class: "error", role: "status" }));
            line.textContent = one.error;
            return;
        }
        if (one.picture) {
            drawPicture(section, one);
        } else {
            drawRows(section, one.rows);
        }
        const isEvidence = one.lnEvidence !== null && one.lnEvidence !== undefined;
        const note = one.note ?? (isEvidence ? `ln P(evidence) = ${digits(one.lnEvidence)}` : "");
        const line = section.querySelector("p.note") ?? section.appendChild(element("p", { class: "note" }));
        line.textContent = note;
    });
}

/** The tables of rows; rows with other headings begin another table. */
function drawRows(section, all) {
    const cells = all.map(cellsOf);
    const parts = [];
    cells.forEach((own, at) => {
        if (at === 0 || headings(own) !== headings(cells[at - 1])) {
            parts.push([]);
        }
        parts[parts.length - 1].push(at);
    });
    let place = section.querySelector(".scroll");
    if (place === null) {
        place = element("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": "Answer" });
        place.append(...parts.map(([first, ...rest]) => emptyTable(cells[first], all[first].figure, rest.length + 1)));
        section.append(place);
    }
    const lines = [...place.querySelectorAll("tbody tr")];
    lines.forEach((line, at) => {
        cells[at].forEach(([, text], column) => {
            line.cells[column].textContent = text;
        });
        const bar = line.querySelector(".bar div");
        if (bar !== null) {
            bar.style.width = `${100 * all[at].figure.p}%`;
        }
    });
}

/** The headings of a row, as one text. */
function headings(cells) {
    return JSON.stringify(cells.map(([heading]) => heading));
}

/** A table of empty cells; rows of probabilities have bars. */
function emptyTable(cells, figure, count) {
    const hasBars = figure.p !== undefined;
    const head = cells.map(([heading], at) => {
        const span = hasBars && at === cells.length - 1 ? { colspan: "2" } : {};
        return heading === "" ? element("td") : element("th", { scope: "col", ...span }, heading);
    });
    const line = () => {
        const bar = hasBars ? [element("td", { class: "bar", "aria-hidden": "true" }, element("div"))] : [];
        return element("tr", {}, ...cells.map(() => element("td")), ...bar);
    };
    const body = element("tbody", {}, ...Array.from({ length: count }, line));
    return element("table", {}, element("thead", {}, element("tr", {}, ...head)), body);
}

/** A colour between the page's background and its mark. */
function shade(share) {
    const stops = [[247, 251, 255], [158, 202, 225], [33, 113, 181], [8, 29, 88]];
    const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
    const first = Math.min(Math.floor(at), stops.length - 2);
    return [0, 1, 2].map((part) => stops[first][part] + (at - first) * (stops[first + 1][part] - stops[first][part]));
}

/** The colours of 256 shares from 0 to 1, each with its opacity. */
const SHADES = Array.from({ length: 256 }, (_, at) => [...shade(at / 255), 255]);

/** Draws the distribution of one variable as bars, of two as a map; and names the most probable values. */
function drawPicture(section, { picture: { left, numbers }, text }) {
    const [across, up] = [left[0].values.length, left[1]?.values.length ?? 60];
    let canvas = section.querySelector("canvas");
    if (canvas === null) {
        canvas = element("canvas", { role: "img", width: String(across), height: String(up) });
        const ends = (axis) => `${axis.name} from ${axis.values[0]} to ${axis.values[axis.values.length - 1]}`;
        const caption = left.length === 2 ? `Across: ${ends(left[0])}; up: ${ends(left[1])}.` : `Across: ${ends(left[0])}.`;
        section.append(element("figure", {}, canvas, element("figcaption", {}, caption)), element("p", { class: "best" }));
    }
    const image = new ImageData(across, up);
    const largest = numbers.reduce((most, p) => Math.max(most, p), 0);
    for (let x = 0; x < across; x++) {
        for (let y = 0; y < up; y++) {
            // The first row of an image is the uppermost.
            const row = up - 1 - y;
            const share = left.length === 2 ? numbers[x * up + row] / largest : Number(row < (numbers[x] / largest) * up) * 0.7;
            image.data.set(SHADES[Math.round(255 * share)], 4 * (y * across + x));
        }
    }
    canvas.getContext("2d").putImageData(image, 0, 0);
    const best = numbers.reduce((most, p, place) => (p > numbers[most] ? place : most), 0);
    const values = named(left, best).map(([name, value]) => `${name} = ${value}`).join(", ");
    section.querySelector(".best").textContent = `Most probable: ${values} (${digits(numbers[best])}).`;
    canvas.setAttribute("aria-label", `${text}. Most probable: ${values}.`);
}

byId("question").addEventListener("input", () => choose(Number(byId("question").value)));
byId("reset").addEventListener("click", () => choose(shownPage.question));
byId("controls").addEventListener("submit", (event) => event.preventDefault());
