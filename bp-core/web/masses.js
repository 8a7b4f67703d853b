// The probability of an interval under laws whose cumulative distribution has no elementary form.
//
// In: the ends of an interval, and the parameters of a law. Out: its probability; NaN where a parameter is invalid. The methods
// are those of the compiler's `special/interval.rs`: the density is integrated from its highest point outwards, in a
// coordinate in which it is smooth, over panels of ten Gauss–Legendre points.

/** Nodes and weights of the rule of ten points (Abramowitz and Stegun, table 25.4). */
const RULE = [
    [0.1488743389816312, 0.29552422471475287],
    [0.4333953941292472, 0.26926671930999635],
    [0.6794095682990244, 0.219086362515982],
    [0.8650633666889845, 0.1494513491505806],
    [0.9739065285171717, 0.06667134430868814],
];

/** δ(x) = ln Γ(x) − ((x − ½) ln x − x + ½ ln 2π); from 16 on by its series (Abramowitz and Stegun 6.1.41). */
function stirlingRest(x) {
    if (x < 16) {
        return lnGamma(x) - ((x - 0.5) * Math.log(x) - x + 0.5 * Math.log(2 * Math.PI));
    }
    const square = 1 / (x * x);
    const series = [-691 / 360360, 1 / 1188, -1 / 1680, 1 / 1260, -1 / 360, 1 / 12];
    return series.reduce((sum, coefficient) => sum * square + coefficient, 0) / x;
}

/** D₀(k, m) = k ln(k/m) + m − k; by the series of artanh where k and m are close (Loader 2000). */
function deviance(k, m) {
    if (k === 0) {
        return m;
    }
    if (Math.abs(k - m) >= 0.1 * (k + m)) {
        return k * Math.log(k / m) + m - k;
    }
    const v = (k - m) / (k + m);
    let sum = (k - m) * v;
    let term = 2 * k * v;
    for (let odd = 3, last = NaN; sum !== last; odd += 2) {
        last = sum;
        term *= v * v;
        sum += term / odd;
    }
    return sum;
}

/** eᵛ − 1 − v */
function exponentialRest(v) {
    if (Math.abs(v) > 0.5) {
        return Math.expm1(v) - v;
    }
    let factor = 1;
    for (let n = 16; n > 2; n--) {
        factor = 1 + (factor * v) / n;
    }
    return 0.5 * v * v * factor;
}

/** z − ln(1 + z): with s = z/(2 + z) it is s z − 2 (s³/3 + s⁵/5 + …). */
function logarithmRest(z) {
    if (Math.abs(z) > 0.5) {
        return z - Math.log1p(z);
    }
    const s = z / (2 + z);
    let series = 0;
    for (let n = 17; n > 0; n--) {
        series = series * s * s + 1 / (2 * n + 1);
    }
    return s * z - 2 * s * s * s * series;
}

/** ln(x/y) for x ≥ y ≥ 0, x − y being known. */
function lnRatio(x, y, difference) {
    if (y <= 0 || x === Infinity) {
        return Infinity;
    }
    return difference < y ? Math.log1p(difference / y) : Math.log(x) - Math.log(y);
}

/** arsinh q − arsinh p for 0 ≤ p ≤ q, q − p being known. */
function asinhDifference(p, q, difference) {
    if (q === Infinity) {
        return Infinity;
    }
    if (p > 1e8) {
        return lnRatio(q, p, difference);
    }
    const whole = q * Math.hypot(1, p) + p * Math.hypot(1, q);
    return whole <= 0 ? 0 : Math.asinh(difference * ((p + q) / whole));
}

/**
 * ∫ exp(curve(v)) dv from 0 over a length in the direction of the sign; the curve, which is concave, falls from 0. `local`
 * gives its slope and the size of its curvature.
 */
function integral(curve, local, sign, length) {
    let [at, sum] = [0, 0];
    for (let count = 0; count < 4000; count++) {
        const [slope, curvature] = local(sign * at);
        // Where the curve is nearly straight, the panels grow.
        const flat = Math.max(-0.25 * Math.log(curvature), 0.75);
        const step = Math.min(2 / Math.sqrt(curvature), 3 / Math.abs(slope), flat, length - at);
        const [middle, half] = [at + 0.5 * step, 0.5 * step];
        const value = (v) => Math.exp(curve(sign * v));
        const both = ([node, weight]) => weight * (value(middle - half * node) + value(middle + half * node));
        const panel = half * RULE.map(both).reduce((one, other) => one + other);
        [sum, at] = [sum + panel, at + step];
        // NaN ends the sum.
        if (!(at < length && panel > 1e-18 * sum)) {
            break;
        }
    }
    return sum;
}

/** Whether the ends are numbers, and these parameters positive. */
function isLaw(low, high, positive, others = []) {
    return [...positive, ...others].every(Number.isFinite) && positive.every((number) => number > 0)
        && !Number.isNaN(low) && !Number.isNaN(high);
}

/** Of a gamma law; x = eᵘ, g = xᵏ e⁻ˣ / Γ(k). */
function gammaMass(start, high, k, rate) {
    if (!isLaw(start, high, [k, rate])) {
        return NaN;
    }
    const low = Math.max(start, 0);
    const [from, to] = [rate * low, rate * high];
    if (!(to > from)) {
        return 0;
    }
    const x = Math.min(Math.max(k, from), to);
    const whole = () => lnRatio(high, low, high - low);
    const [below, above] = k <= from ? [0, whole()] : k >= to ? [whole(), 0] : [lnRatio(x, from, x - from), lnRatio(to, x, to - x)];
    const curve = (v) => (k - x) * v - x * exponentialRest(v);
    const local = (v) => [k - x * Math.exp(v), x * Math.exp(v)];
    const sum = integral(curve, local, -1, below) + integral(curve, local, 1, above);
    return Math.sqrt(k / (2 * Math.PI)) * sum * Math.exp(-deviance(k, x) - stirlingRest(k));
}

/** Of a beta law; x = eᵘ/(1 + eᵘ), g = xᵃ (1 − x)ᵇ / B(a, b). */
function betaMass(start, end, first, second) {
    if (!isLaw(start, end, [first, second])) {
        return NaN;
    }
    const [low, high] = [Math.max(start, 0), Math.min(end, 1)];
    if (low >= high) {
        return 0;
    }
    const total = first + second;
    const mode = first / total;
    const length = (from, to, d) => lnRatio(to[0], from[0], d) + lnRatio(from[1], to[1], d);
    const [lower, upper] = [[low, 1 - low], [high, 1 - high]];
    let [top, below, above] = [[mode, second / total], 0, 0];
    if (mode <= low) {
        [top, above] = [lower, length(lower, upper, high - low)];
    } else if (mode >= high) {
        [top, below] = [upper, length(lower, upper, high - low)];
    } else {
        [below, above] = [length(lower, top, mode - low), length(top, upper, high - mode)];
    }
    let [x, y] = top;
    let [a, b] = [first, second];
    const exponent = stirlingRest(total) - stirlingRest(a) - stirlingRest(b) - deviance(a, total * x) - deviance(b, total * y);
    let slope = mode > low && mode < high ? 0 : a * y - b * x;
    // Seen from the nearer end, where x ≤ ½.
    if (x > 0.5) {
        [x, y, a, b, slope, below, above] = [y, x, b, a, -slope, above, below];
    }
    const less = (v) => {
        if (v > 30) {
            return v + Math.log(x + y * Math.exp(-v)) - x * v;
        }
        // Farther out both rests are large, and nearly equal.
        return v > 1 ? Math.log1p(x * Math.expm1(v)) - x * v : x * exponentialRest(v) - logarithmRest(x * Math.expm1(v));
    };
    const curve = (v) => slope * v - total * less(v);
    const local = (v) => {
        const small = Math.exp(-Math.abs(v));
        const [one, other] = v > 0 ? [x, y * small] : [x * small, y];
        const [p, q] = [one / (one + other), other / (one + other)];
        return [a * q - b * p, total * p * q];
    };
    const sum = integral(curve, local, -1, below) + integral(curve, local, 1, above);
    return Math.sqrt((first / total) * (second / (2 * Math.PI))) * sum * Math.exp(exponent);
}

/** Of a Student law; t = √ν sinh u, g = √(ν/2π) Γ(½ν + ½)/(Γ(½ν) √(½ν)) cosh⁻ᵛ u. */
function studentMass(low, high, freedom, m, s) {
    if (!isLaw(low, high, [freedom, s], [m])) {
        return NaN;
    }
    if (low >= high) {
        return 0;
    }
    const root = Math.sqrt(freedom);
    const half = 0.5 * freedom;
    const rest = half * Math.log1p(0.5 / half) - 0.5 + stirlingRest(half + 0.5) - stirlingRest(half);
    // From sinh u₀ = p ≥ 0 over a distance in u.
    const side = (p, length) => {
        const size = Math.hypot(1, p);
        const [tanh, square] = [p / size, 1 / size / size];
        const curve = (v) => {
            const sinh = Math.sinh(0.5 * v);
            const ln = v > 30 ? v + Math.log(0.5 * (1 + tanh)) : Math.log1p(2 * sinh * sinh + tanh * Math.sinh(v));
            return -freedom * ln;
        };
        const local = (v) => {
            const whole = 1 + tanh * Math.tanh(v);
            const steep = Math.cosh(v) * whole;
            return [(freedom * (tanh + Math.tanh(v))) / whole, (freedom * square) / steep / steep];
        };
        return integral(curve, local, 1, length);
    };
    const [first, last, length] = [(low - m) / s / root, (high - m) / s / root, (high - low) / s / root];
    let [p, sum] = [0, 0];
    if (first < 0 && last > 0) {
        sum = side(0, Math.asinh(-first)) + side(0, Math.asinh(last));
    } else {
        const far = first < 0 ? -first : last;
        p = first < 0 ? -last : first;
        sum = side(p, asinhDifference(p, far, length));
    }
    const lnCosh = p > 1e8 ? Math.log(p) : 0.5 * Math.log1p(p * p);
    return Math.sqrt(freedom / (2 * Math.PI)) * sum * Math.exp(rest - freedom * lnCosh);
}

/** Of a von Mises law, on any number of turns; u = t. */
function misesMass(low, high, m, k) {
    if (!isLaw(low, high, [k], [m, high - low])) {
        return NaN;
    }
    if (low >= high) {
        return 0;
    }
    const turn = 2 * Math.PI;
    const turns = Math.floor((high - low) / turn);
    const side = (t, length) => {
        const curve = (v) => -2 * k * Math.sin(t + 0.5 * v) * Math.sin(0.5 * v);
        return integral(curve, (v) => [k * Math.sin(t + v), k], 1, length) * Math.exp(-2 * k * Math.sin(0.5 * t) ** 2);
    };
    // Intervals [t, t + length] of [0, π], by the symmetry of the density.
    let from = low - m - turn * Math.round((low - m) / turn);
    let left = high - low - turn * turns;
    let sum = 0;
    for (let count = 0; left > 0 && count < 4; count++) {
        if (from >= Math.PI) {
            from -= turn;
        }
        const part = Math.min(left, (from < 0 ? 0 : Math.PI) - from);
        sum += side(from < 0 ? Math.max(-from - part, 0) : from, part);
        [from, left] = [from + part, left - part];
    }
    // 2π I₀(k) e⁻ᵏ
    return turns + sum / (turn * Math.exp(lnBessel(k) - k));
}
