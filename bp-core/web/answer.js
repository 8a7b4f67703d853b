// What functions are given, and how answers are read from the results of runs.
//
// In: a question as the compiler describes it, the values of its controls, and the results of its runs. Out: inputs of
// functions; rows, as `bp ask --json` has them: names of values, and a figure. The statistics are those of `bp ask`.

/** Scores that differ by less than this share of the largest are tied. */
const TIE = 1e-9;

/** What is wrong where a form refuses a number, and where a density is too small or too large for a number. */
const OUTSIDE = "a number of a form is outside its range";
const BEYOND = "the answer is beyond the range of numbers: a density or a weight overflows";

/** The inputs of functions: the values of controls, those of the elements of a family in one list. */
function inputsOf({ controls }, values) {
    const inputs = {};
    for (const { name, element } of controls) {
        if (element === undefined) {
            inputs[name] = values[name];
        } else {
            inputs[element.of] ??= [];
            inputs[element.of][element.place] = values[name];
        }
    }
    return inputs;
}

/** A number with six digits, as `bp ask` prints it. */
function digits(number) {
    if (typeof number !== "number") {
        return String(number);
    }
    if (number === 0 || !Number.isFinite(number)) {
        return String(number + 0);
    }
    // The exponent after rounding.
    const scientific = number.toExponential(5);
    const exponent = Number(scientific.split("e")[1]);
    return exponent >= -4 && exponent <= 5 ? number.toFixed(5 - exponent) : scientific.replace("e+", "e");
}

/** A standard error, with two digits. */
function twoDigits(number) {
    const rounded = Number(number.toExponential(1));
    const isShort = number === 0 || (Math.abs(rounded) >= 1e-4 && Math.abs(rounded) < 1e4);
    return isShort ? String(rounded) : number.toExponential(1).replace("e+", "e");
}

/** The headings and the texts of a figure, as the columns of `bp ask`. */
function columns(figure) {
    const { level, error } = figure;
    const one = (name, number, own = error) =>
        own === undefined ? [name, digits(number)] : [`${name} ± error`, `${digits(number)} ± ${twoDigits(own)}`];
    const alone = (name) => figure[name] !== undefined;
    const shares = (quantiles) => ["5 %", "50 %", "95 %"].map((name, at) => one(name, quantiles[at]));
    if (alone("p")) {
        return [one("probability", figure.p)];
    }
    if (alone("ln_p")) {
        return [one("ln probability", figure.ln_p)];
    }
    if (alone("by")) {
        return [["estimated by", figure.by]];
    }
    if (alone("draw")) {
        return [["draw", String(figure.draw)]];
    }
    if (alone("quantile")) {
        return [one("level", level, undefined), one("quantile", figure.quantile)];
    }
    if (alone("interval")) {
        const ends = ["low", "high"].map((name, at) => one(name, figure.interval[at], figure.errors?.[at]));
        return [one("level", level, undefined), ...ends];
    }
    const plain = ["density", "expectation", "variance"].find(alone);
    if (plain !== undefined) {
        return [one(plain, figure[plain])];
    }
    const inNats = ["entropy", "information", "divergence"].find(alone);
    if (inNats !== undefined) {
        const [heading, text] = one(inNats, figure[inNats]);
        return [[heading, typeof figure[inNats] === "number" ? `${text} nats` : text]];
    }
    const { law, mean, deviation, quantiles } = figure;
    if (Array.isArray(mean)) {
        const [place, spread] = [one("mean", ...mean), one("deviation", deviation[0])];
        return [place, spread, ...shares(quantiles.map(([quantile]) => quantile))];
    }
    if (quantiles === undefined) {
        return [["mean ± deviation", `${digits(mean)} ± ${digits(deviation)}`]];
    }
    const named = law && ["distribution", `${law.name}(${law.parameters.map((one) => Number(one.toPrecision(6))).join(", ")})`];
    return [...(named ? [named] : []), one("mean", mean), one("deviation", deviation), ...shares(quantiles)];
}

/** The headings and the texts of a row; a variable without a value heads its row, not a column. Covariances follow. */
function cellsOf({ values, figure, covariances = [] }) {
    const valued = values.filter(([, value]) => value !== "");
    const names = values.filter(([, value]) => value === "").map(([name]) => name);
    const beside = covariances.map(([name, number], at) => [`${at === 0 ? "covariance " : ""}with ${name}`, digits(number)]);
    return [...valued, ...(names.length > 0 ? [["", names.join(" ")]] : []), ...columns(figure), ...beside];
}

/** ln P(evidence) of an answer; null where nothing is known. Soft evidence is no event. */
function lnEvidence(shown, results) {
    const [{ run, soft, is_law: isLaw }] = shown.sources;
    const { lnEvidence: ln } = results[run];
    if (isLaw && ln !== null && !Number.isFinite(ln)) {
        throw new RangeError(BEYOND);
    }
    return shown.text.includes("|") && soft.length === 0 && Number.isFinite(ln) ? ln : null;
}

/** The sum of a list. */
function total(numbers) {
    return numbers.reduce((sum, number) => sum + number, 0);
}

/** The number of combinations of values of some axes. */
function combinations(axes) {
    return axes.reduce((count, axis) => count * axis.values.length, 1);
}

/** The place of the value of each axis at a position, the last axis fastest. */
function placesAt(axes, position) {
    const places = new Array(axes.length);
    for (let at = axes.length - 1; at >= 0; at--) {
        const count = axes[at].values.length;
        places[at] = position % count;
        position = Math.floor(position / count);
    }
    return places;
}

/** Pairs of a variable and the name of its value. */
function named(axes, position) {
    return placesAt(axes, position).map((place, at) => [axes[at].name, axes[at].values[place]]);
}

/** The results of a run, one for each instant that it shows; without instants there is one. */
function shownOf({ run }, results) {
    return results[run].each ?? [results[run]];
}

/**
 * The numbers of a distribution, those of each context contiguous; instants are the first contexts. A number that is no
 * probability, and a context that is the only one and has probability 0, are errors.
 */
function distribution(source, results) {
    return shownOf(source, results).flatMap(({ answers }) => ofInstant(source, answers[source.output]));
}

/** The numbers of a distribution at one instant. */
function ofInstant(source, cells) {
    const numbers = source.order.length > 0 ? source.order.map((place) => cells[place]) : Array.from(cells);
    let sum = 0;
    for (let at = 0; at < numbers.length; at++) {
        if (!(numbers[at] >= 0 && numbers[at] < Infinity)) {
            throw new RangeError(OUTSIDE);
        }
        sum += numbers[at];
    }
    if (sum === 0 && source.right.length === 0) {
        throw new RangeError("the evidence is impossible: its probability is 0");
    }
    return source.soft.length > 0 ? softened(source, numbers) : numbers;
}

/** The numbers after soft evidence, P′(S X) = P(S X) q(X) / P(X) (Jeffrey 1965), summed over the variables that have it. */
function softened({ left, right, soft }, numbers) {
    const counts = [...soft].sort((one, other) => one.column - other.column).map(({ weights }) => weights.length);
    const run = counts.reduce((product, count) => product * count, 1);
    const width = combinations(left) * run;
    const sums = [];
    for (let first = 0; first < numbers.length; first += width) {
        const own = numbers.slice(first, first + width);
        for (const { name, column, weights } of soft) {
            const step = counts.slice(column + 1).reduce((product, count) => product * count, 1);
            const value = (at) => Math.floor(at / step) % weights.length;
            const believed = new Array(weights.length).fill(0);
            own.forEach((p, at) => {
                believed[value(at)] += p;
            });
            const excluded = weights.findIndex((weight, at) => weight > 0 && believed[at] === 0);
            if (excluded >= 0 && right.length === 0) {
                throw new RangeError(`soft evidence on \`${name}\` gives a value a probability that the other evidence excludes`);
            }
            own.forEach((p, at) => {
                const q = believed[value(at)];
                own[at] = excluded >= 0 || q === 0 ? 0 : p * (weights[value(at)] / q);
            });
        }
        for (let at = 0; at < width; at += run) {
            sums.push(total(own.slice(at, at + run)));
        }
    }
    return sums;
}

/** The quantile of a finite variable: the smallest value whose cumulative probability reaches the level. */
function quantile(axis, alone, level) {
    const wanted = level * total(alone);
    let reached = 0;
    let last = 0;
    for (let place = 0; place < alone.length; place++) {
        if (!(alone[place] > 0)) {
            continue;
        }
        last = place;
        if (reached + alone[place] >= wanted * (1 - 1e-12)) {
            if (axis.edges.length === 0) {
                return axis.numbers[place];
            }
            const share = Math.min(Math.max((wanted - reached) / alone[place], 0), 1);
            return axis.edges[place] + share * (axis.edges[place + 1] - axis.edges[place]);
        }
        reached += alone[place];
    }
    return axis.edges.length === 0 ? axis.numbers[last] : axis.edges[last + 1];
}

/** The mutual information of two groups of values, those of the second contiguous. */
function information(numbers, second) {
    const rows = new Array(numbers.length / second).fill(0);
    const columns = new Array(second).fill(0);
    numbers.forEach((p, at) => {
        rows[Math.floor(at / second)] += p;
        columns[at % second] += p;
    });
    let sum = 0;
    numbers.forEach((p, at) => {
        if (p > 0) {
            sum += p * (Math.log(p) - Math.log(rows[Math.floor(at / second)]) - Math.log(columns[at % second]));
        }
    });
    return Math.max(sum, 0);
}

/** Places ordered by their numbers, the largest first; ties by the place. */
function ranked(numbers, places) {
    const sorted = [...places].sort((one, other) => numbers[other] - numbers[one]);
    const ordered = [];
    while (ordered.length < sorted.length) {
        const rest = sorted.slice(ordered.length);
        const least = numbers[rest[0]] * (1 - TIE);
        const tied = rest.filter((place) => numbers[place] >= least);
        ordered.push(...tied.sort((one, other) => one - other));
    }
    return ordered;
}

/** The rows of one context; `row` makes a row with a figure, and with the values at a place. */
function rowsOf(shown, numbers, wanted, row) {
    const { left } = shown.sources[0];
    const { word, count, levels, level } = shown.statistic;
    const probability = (place) => row(shown.is_density ? { density: numbers[place] } : { p: numbers[place] }, place);
    const marginal = (at) => {
        const alone = new Array(left[at].values.length).fill(0);
        numbers.forEach((p, place) => {
            alone[placesAt(left, place)[at]] += p;
        });
        return alone;
    };
    const tied = () => {
        const largest = Math.max(...wanted.map((place) => numbers[place]));
        return wanted.filter((place) => numbers[place] > 0 && numbers[place] >= largest * (1 - TIE));
    };
    const entropy = () => total(wanted.map((place) => entropyTerm(numbers[place])));
    const moments = (at) => {
        const weighted = marginal(at).map((p, place) => [p, left[at].numbers[place]]);
        const mean = total(weighted.map(([p, value]) => p * value));
        return [mean, total(weighted.map(([p, value]) => p * (value - mean) ** 2))];
    };
    const each = (figures) => left.flatMap((axis, at) => figures(at).map((figure) => row(figure, null, axis.name)));
    switch (word) {
        case "":
            return wanted.map(probability);
        case "max":
            return tied().slice(0, 1).map(probability);
        case "argmax":
            return tied().map(probability);
        case "best":
            return ranked(numbers, wanted.filter((place) => numbers[place] > 0)).slice(0, count).map(probability);
        case "entropy":
            return [row({ entropy: entropy() })];
        case "expectation":
            return each((at) => [{ expectation: moments(at)[0] }]);
        case "variance":
            return each((at) => [{ variance: moments(at)[1] }]);
        case "quantile":
            return each((at) => levels.map((one) => ({ level: one, quantile: quantile(left[at], marginal(at), one) })));
        case "interval":
            return each((at) => [{ level, interval: levels.map((one) => quantile(left[at], marginal(at), one)) }]);
        case "information": {
            const second = combinations(left.slice(1));
            return [row({ information: information([...numbers], second) })];
        }
        default:
            throw new Error(`internal: \`${word}\` is no statistic of one distribution`);
    }
}

/** The divergence of the first distribution from the second, in nats. */
function divergence(first, second) {
    const sum = total(Array.from(first, (p, place) => (p > 0 ? p * Math.log(p / second[place]) : 0)));
    const figure = sum < Infinity ? { divergence: Math.max(sum, 0) } : { divergence: "infinite", infinite: true };
    return [{ values: [], figure }];
}

/** The rows of an answer. */
function rows(shown, results) {
    const [source] = shown.sources;
    const instants = shownOf(source, results);
    if (source.is_law) {
        const laws = shown.sources.map((own) => shownOf(own, results).map(({ moments }) => lawOf(moments, own.left.length)));
        if (shown.statistic.word === "divergence") {
            return [{ values: [], figure: finite("divergence", lawDivergence(laws[0][0], laws[1][0])) }];
        }
        return laws[0].flatMap((law, at) => lawRows(shown, law, instantOf(instants[at])));
    }
    const distributions = shown.sources.map((source) => distribution(source, results));
    if (shown.statistic.word === "divergence") {
        return divergence(...distributions);
    }
    const [numbers] = distributions;
    const { left, right } = source;
    const width = combinations(left);
    const isWanted = (place) => {
        const places = placesAt(left, place);
        return shown.wanted.every(([column, ordinal]) => places[column] === ordinal);
    };
    const wanted = Array.from({ length: width }, (_, place) => place).filter(isWanted);
    const contexts = combinations(right);
    const made = [];
    for (let context = 0; context * width < numbers.length; context++) {
        const own = numbers.slice(context * width, (context + 1) * width);
        if (shown.statistic.word !== "" && !own.some((p) => p > 0)) {
            continue;
        }
        const instant = instants[Math.floor(context / contexts)];
        const row = (figure, place = null, name = null) => {
            const values = [...instantOf(instant), ...named(right, context % contexts)];
            if (place !== null) {
                values.push(...named(left, place), ...shown.bound);
            } else if (name !== null) {
                values.push([name, ""]);
            }
            return { values, figure };
        };
        if (shown.statistic.word === "sequence") {
            const place = left.reduce((place, { name, values }) => place * values.length + instant.places[name], 0);
            made.push(row({ p: own[place] }, place));
        } else {
            made.push(...rowsOf(shown, own, wanted, row));
        }
    }
    return made;
}

/** The name and the number of an instant, where several are shown. */
function instantOf({ instant }) {
    return instant === undefined ? [] : [["t", instant]];
}
