// Normal laws: their moments, and the rows of their statistics.
//
// In: moments: means, then covariances, row by row up to the diagonal. Out: laws with a mean and a full covariance matrix; rows as
// `bp ask --json` has them. Invariant: a law that is singular has no density; its numbers are infinite or an error, never NaN.

/** A pivot below this share of a variance is rounding: the variable is determined by the others. */
const SINGULAR = 1e-13;

/** The number of variables of a law with so many moments. */
function countOf(moments) {
    let count = 0;
    while (count + (count * (count + 1)) / 2 < moments) {
        count += 1;
    }
    return count;
}

/** The law with these moments. */
function lawOf(moments, count) {
    if (moments.some((number) => !Number.isFinite(number))) {
        throw new RangeError(OUTSIDE);
    }
    const at = (row, column) => moments[count + (row * (row + 1)) / 2 + column];
    const covariance = Array.from({ length: count }, (_, row) =>
        Array.from({ length: count }, (_, column) => at(Math.max(row, column), Math.min(row, column))));
    return { mean: moments.slice(0, count), covariance };
}

/** The moments of some variables, from one place to another. */
function momentsOf({ mean, covariance }, from, to) {
    const rows = covariance.slice(from, to).flatMap((row, at) => row.slice(from, from + at + 1));
    return [...mean.slice(from, to), ...rows];
}

/** The lower triangle L of Σ = L Lᵀ, with a row of zeros in place of each variable that the ones before it determine. */
function triangle(covariance) {
    const rows = [];
    const isFree = [];
    covariance.forEach((own, at) => {
        const row = new Array(covariance.length).fill(0);
        for (let column = 0; column < at; column++) {
            if (isFree[column]) {
                const inner = total(row.slice(0, column).map((cell, place) => cell * rows[column][place]));
                row[column] = (own[column] - inner) / rows[column][column];
            }
        }
        const rest = own[at] - total(row.map((cell) => cell * cell));
        isFree.push(rest > SINGULAR * own[at]);
        row[at] = isFree[at] ? Math.sqrt(rest) : 0;
        rows.push(row);
    });
    return { rows, isFree };
}

/** L⁻¹ x; the places of determined variables are 0. */
function solvedForward({ rows, isFree }, x) {
    const solved = [];
    x.forEach((number, at) => {
        const inner = total(solved.map((cell, place) => cell * rows[at][place]));
        solved.push(isFree[at] ? (number - inner) / rows[at][at] : 0);
    });
    return solved;
}

/** L⁻ᵀ x */
function solvedBackward({ rows, isFree }, x) {
    const solved = new Array(x.length).fill(0);
    for (let at = x.length - 1; at >= 0; at--) {
        const inner = total(solved.map((cell, place) => cell * rows[place][at]));
        solved[at] = isFree[at] ? (x[at] - inner) / rows[at][at] : 0;
    }
    return solved;
}

/**
 * A law after the law of some of its variables, those from a place on, has become another: m ← m + G (m′ − m_c),
 * Σ ← Σ + G (Σ′ − Σ_c) Gᵀ with G = Σ_·c Σ_c⁻¹ (Rauch, Tung and Striebel 1965).
 */
function corrected({ mean, covariance }, from, later) {
    const to = from + later.mean.length;
    const own = triangle(covariance.slice(from, to).map((row) => row.slice(from, to)));
    const gains = covariance.map((row) => solvedBackward(own, solvedForward(own, row.slice(from, to))));
    const shift = later.mean.map((number, at) => number - mean[from + at]);
    const change = later.covariance.map((row, at) => row.map((cell, place) => cell - covariance[from + at][from + place]));
    const times = (gain) => change[0].map((_, column) => total(gain.map((cell, row) => cell * change[row][column])));
    const halves = gains.map(times);
    const dot = (one, other) => total(one.map((cell, at) => cell * other[at]));
    return {
        mean: mean.map((number, at) => number + dot(gains[at], shift)),
        covariance: covariance.map((row, at) => row.map((cell, column) => cell + dot(halves[at], gains[column]))),
    };
}

/** ln |Σ|^½; −∞ of a singular law. */
function lnVolume({ covariance }) {
    const { rows, isFree } = triangle(covariance);
    return isFree.every((free) => free) ? total(rows.map((row, at) => Math.log(row[at]))) : -Infinity;
}

/** ln of the density at the mean; ∞ of a singular law. */
function lnLargest(law) {
    return -0.5 * law.mean.length * Math.log(2 * Math.PI) - lnVolume(law);
}

/** Some variables of a law, from one place to another. */
function partOf(law, from, to) {
    return lawOf(momentsOf(law, from, to), to - from);
}

/** ln of the density at some values. */
function lnDensity(law, values) {
    const own = triangle(law.covariance);
    if (!own.isFree.every((free) => free)) {
        throw new RangeError("the searched variables determine each other: there is no density");
    }
    const solved = solvedForward(own, values.map((value, at) => value - law.mean[at]));
    return lnLargest(law) - 0.5 * total(solved.map((cell) => cell * cell));
}

/** The divergence of one law from another, in nats. */
function lawDivergence(law, from) {
    const [own, other] = [triangle(law.covariance), triangle(from.covariance)];
    if (![...own.isFree, ...other.isFree].every((free) => free)) {
        throw new RangeError("a page compares normal laws without determined variables only");
    }
    const shift = solvedForward(other, law.mean.map((number, at) => number - from.mean[at]));
    const columns = law.mean.map((_, column) => solvedForward(other, own.rows.map((row) => row[column])));
    const squares = total([shift, ...columns].flat().map((cell) => cell * cell));
    return Math.max(0.5 * (squares - law.mean.length) + lnVolume(from) - lnVolume(law), 0);
}

/** The quantile of the standard normal law, by Newton's steps on ln Φ of the lower tail. */
function standardQuantile(level) {
    if (level > 0.5) {
        return -standardQuantile(1 - level);
    }
    // The start of Abramowitz and Stegun 26.2.23.
    const t = Math.sqrt(-2 * Math.log(level));
    let x = (2.515517 + t * (0.802853 + t * 0.010328)) / (1 + t * (1.432788 + t * (0.189269 + t * 0.001308))) - t;
    for (let step = 0; step < 6; step++) {
        const tail = normalCumulative(x);
        const density = bell(x) / Math.sqrt(2 * Math.PI);
        x -= (tail / density) * Math.log(tail / level);
    }
    return x;
}

/** A quantile of a normal law; 0 where it is rounding beside the deviation. */
function lawQuantile(mean, deviation, level) {
    const quantile = mean + deviation * standardQuantile(level);
    return Math.abs(quantile) <= 1e-12 * deviation ? 0 : quantile;
}

/** An infinite number of a figure is a word. */
function finite(key, number) {
    return { [key]: Number.isFinite(number) ? number : number > 0 ? "infinite" : "-infinite" };
}

/** Above this many reals, covariances are not shown. */
const MOST_COVARIANCES = 100;

/** The rows of a normal law; `context` names the instant, if several are shown. */
function lawRows(shown, law, context) {
    const { word, levels, level } = shown.statistic;
    const names = shown.sources[0].left.map(({ name }) => name);
    const row = (figure, values = []) => ({ values: [...context, ...values], figure });
    const at = (values) => names.map((name, place) => [name, String(values[place])]);
    const each = (figures) => names.flatMap((name, place) => {
        const [mean, deviation] = [law.mean[place], Math.sqrt(Math.max(law.covariance[place][place], 0))];
        return figures(mean, deviation).map((figure) => row(figure, [[name, ""]]));
    });
    const moments = () => {
        const rows = each((mean, deviation) => [{ mean, deviation }]);
        const isShown = names.length > 1 && names.length <= MOST_COVARIANCES;
        const beside = (place) => ({ covariances: names.map((name, at) => [name, law.covariance[place][at]]) });
        return rows.map((own, place) => ({ ...own, ...(isShown ? beside(place) : {}) }));
    };
    switch (word) {
        case "":
            if (shown.at.length > 0) {
                return [row({ density: Math.exp(lnDensity(law, shown.at)) }, at(shown.at))];
            }
            return moments();
        case "sequence":
            return moments();
        case "max":
        case "argmax":
            return [row(finite("density", Math.exp(lnLargest(law))), at(law.mean))];
        case "entropy":
            return [row(finite("entropy", 0.5 * law.mean.length - lnLargest(law)))];
        case "information": {
            const first = shown.statistic.count;
            const [one, other] = [partOf(law, 0, first), partOf(law, first, names.length)];
            return [row(finite("information", Math.max(lnVolume(one) + lnVolume(other) - lnVolume(law), 0)))];
        }
        case "expectation":
            return each((mean) => [{ expectation: mean }]);
        case "variance":
            return each((mean, deviation) => [{ variance: deviation ** 2 }]);
        case "quantile":
            return each((mean, deviation) =>
                levels.map((one) => ({ level: one, quantile: lawQuantile(mean, deviation, one) })));
        case "interval":
            return each((mean, deviation) =>
                [{ level, interval: levels.map((one) => lawQuantile(mean, deviation, one)) }]);
        default:
            throw new Error(`internal: \`${word}\` is no statistic of a normal law`);
    }
}
