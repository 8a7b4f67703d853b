// The functions of emitted kernels that JavaScript lacks, and the binding of their inputs.
//
// In: numbers. Out: a number; truth values are 1 and 0. Relative errors, compared with constants of 50 digits: Φ at most
// 2e-15, ln Γ and ln I₀ at most 5e-16. The operators have the meaning of the interpreter.

/** The smaller number; a number that is NaN is passed over. */
function minimum(x, y) {
    return x < y || y !== y ? x : y;
}

/** The larger number; a number that is NaN is passed over. */
function maximum(x, y) {
    return x > y || y !== y ? x : y;
}

/** The nearest whole number, halves away from zero. */
function round(x) {
    const whole = Math.trunc(x);
    return Math.abs(x - whole) >= 0.5 ? whole + Math.sign(x) : whole;
}

/** xʸ, as IEEE 754 has it: 1 to any power is 1, and so is −1 to an infinite one. */
function power(x, y) {
    return x === 1 || (x === -1 && Math.abs(y) === Infinity) ? 1 : x ** y;
}

/** −x ln x, and 0 outside ]0, 1[. */
function entropyTerm(x) {
    return x <= 0 || x >= 1 ? 0 : -x * Math.log(x);
}

/** A number as a whole one, for an index; NaN is 0. */
function signed(x) {
    return Math.trunc(x) || 0;
}

/** An index of an axis that wraps around if `wraps` is not 0. */
function turned(at, extent, wraps) {
    return wraps !== 0 ? ((at % extent) + extent) % extent : at;
}

/** e to the power −x²/2. The square is split, because its rounding error would be magnified. */
function bell(x) {
    const high = Math.fround(x);
    return Math.exp(-0.5 * high * high) * Math.exp(-0.5 * (x - high) * (x + high));
}

/**
 * Φ(x), the cumulative distribution of the standard normal law: near 0 by the series Σ x²ᵏ⁺¹ / (1·3·…·(2k + 1))
 * (Abramowitz and Stegun 26.2.11), in the tails by the continued fraction 1/(x + 1/(x + 2/(x + …))) (26.2.14).
 */
function normalCumulative(x) {
    const size = Math.abs(x);
    const density = bell(size) / Math.sqrt(2 * Math.PI);
    if (size < 1.5) {
        let term = x;
        let sum = x;
        for (let odd = 3; Math.abs(term) > 1e-17 * Math.abs(sum); odd += 2) {
            term *= (x * x) / odd;
            sum += term;
        }
        return 0.5 + density * sum;
    }
    let fraction = size;
    for (let k = Math.ceil(20 + 400 / (size * size)); k > 0; k--) {
        fraction = size + k / fraction;
    }
    const tail = density / fraction;
    return x < 0 ? tail : 1 - tail;
}

/** ζ(k) − 1, by Euler and Maclaurin's sum. */
function zetaLessOne(k) {
    const from = 50;
    let sum = 0;
    for (let n = from - 1; n > 1; n--) {
        sum += n ** -k;
    }
    const first = k / 12;
    const second = (k * (k + 1) * (k + 2)) / 720;
    const third = (k * (k + 1) * (k + 2) * (k + 3) * (k + 4)) / 30240;
    const square = from * from;
    const rest = from / (k - 1) + 0.5 + (first - (second - third / square) / square) / from;
    return sum + rest * from ** -k;
}

const ZETA = Array.from({ length: 30 }, (_, place) => zetaLessOne(place + 2));
const ONE_LESS_EULER = 0.4227843350984671;

/** ln Γ(2 + z), |z| ≤ ½: (1 − γ) z + Σ (−1)ᵏ (ζ(k) − 1) zᵏ / k (Abramowitz and Stegun 6.1.33). */
function lnGammaNearTwo(z) {
    let sum = 0;
    for (let place = ZETA.length - 1; place >= 0; place--) {
        sum = -z * sum + ZETA[place] / (place + 2);
    }
    return z * (ONE_LESS_EULER + z * sum);
}

/** ln Γ(x), for x > 0: near 1 and 2 by a series, above 10 by Stirling's (Abramowitz and Stegun 6.1.41), else shifted. */
function lnGamma(x) {
    if (!(x > 0)) {
        return x === 0 ? Infinity : NaN;
    }
    if (x < 0.5) {
        return lnGammaNearTwo(x) - Math.log1p(x) - Math.log(x);
    }
    if (x < 1.5) {
        return lnGammaNearTwo(x - 1) - Math.log1p(x - 1);
    }
    if (x < 10) {
        let product = 1;
        let near = x;
        while (near > 2.5) {
            near -= 1;
            product *= near;
        }
        return Math.log(product) + lnGammaNearTwo(near - 2);
    }
    const square = 1 / (x * x);
    const series = 1 / 12 - square * (1 / 360 - square * (1 / 1260 - square * (1 / 1680 - square * (1 / 1188
        - square * (691 / 360360 - square / 156)))));
    return (x - 0.5) * (Math.log(x) - 1) + (0.5 * Math.log(2 * Math.PI) - 0.5) + series / x;
}

/**
 * ln I₀(x): by Σ (x/2)²ᵏ / (k!)² (Abramowitz and Stegun 9.6.12) up to 30, then by the asymptotic series
 * eˣ / √(2πx) Σ Π (2j − 1)² / (8jx) (9.7.1).
 */
function lnBessel(signedX) {
    const x = Math.abs(signedX);
    let [term, sum] = [1, 0];
    if (x <= 30) {
        const square = 0.25 * x * x;
        for (let k = 1; term > 1e-17 * sum; k++) {
            term *= square / (k * k);
            sum += term;
        }
        return Math.log1p(sum);
    }
    for (let j = 1; term > 1e-18; j++) {
        term *= (2 * j - 1) ** 2 / (8 * j * x);
        sum += term;
    }
    return x - 0.5 * Math.log(2 * Math.PI * x) + Math.log1p(sum);
}

/** Numbers that are given by their places among the different ones, each place with `width` digits to the base 64. */
function unpacked(different, width, digits) {
    const value = (code) => "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/".indexOf(code);
    const values = Object.fromEntries(Array.from({ length: 128 }, (_, code) => [code, value(String.fromCharCode(code))]));
    return Float64Array.from({ length: digits.length / width }, (_, at) => {
        let place = 0;
        for (let digit = at * width; digit < (at + 1) * width; digit++) {
            place = place * 64 + values[digits.charCodeAt(digit)];
        }
        return different[place];
    });
}

/**
 * Copies an input into the array that a kernel reads, and returns whether it has changed. `given` is a number, an array,
 * or undefined for the default `otherwise`; `ordinal` converts a value of a variable to its ordinal.
 */
function take(array, name, given, otherwise, ordinal) {
    const number = given ?? otherwise;
    if (number === undefined) {
        throw new RangeError(`\`${name}\` was not given`);
    }
    const isList = typeof number !== "number";
    if (isList && number.length !== array.length) {
        throw new RangeError(`\`${name}\`: ${number.length} numbers were given, but ${array.length} are expected`);
    }
    let changed = false;
    for (let at = 0; at < array.length; at++) {
        const own = isList ? number[at] : number;
        if (!Number.isFinite(own)) {
            throw new RangeError(`\`${name}\`: ${own} is not a finite number`);
        }
        const value = ordinal === undefined ? own : ordinal(own, name);
        if (array[at] !== value) {
            array[at] = value;
            changed = true;
        }
    }
    return changed;
}

/** The ordinal of an integer among `count` values from `first` on. */
function whole(first, count) {
    return (number, name) => {
        const ordinal = number - first;
        if (!Number.isInteger(ordinal) || ordinal < 0 || ordinal >= count) {
            throw new RangeError(`\`${name}\`: ${number} is not an integer from ${first} to ${first + count - 1}`);
        }
        return ordinal;
    };
}

/** The bin that holds a number; the ends of a circle meet. A number that differs from an edge by rounding only is that edge. */
function bins(edges, isCircle) {
    const count = edges.length - 1;
    const [low, high] = [edges[0], edges[count]];
    // A few units in the last place of the edge, or of the narrower bin beside it.
    const rounding = (at) => {
        const below = at > 0 ? edges[at] - edges[at - 1] : Infinity;
        const above = at < count ? edges[at + 1] - edges[at] : Infinity;
        const width = Math.min(below, above);
        return Math.min(4 * Number.EPSILON * Math.max(Math.abs(edges[at]), width), width / 4);
    };
    return (number, name) => {
        const turn = high - low;
        const inside = isCircle ? low + ((((number - low) % turn) + turn) % turn) : number;
        const next = edges.findIndex((edge) => edge > inside);
        let below = next < 0 ? count + 1 : next;
        if (below <= count && edges[below] - inside <= rounding(below)) {
            below += 1;
        }
        if (Number.isNaN(inside) || below === 0 || (below > count && !isCircle && inside - high > rounding(count))) {
            throw new RangeError(`\`${name}\`: ${number} is not between ${low} and ${high}`);
        }
        return below <= count ? below - 1 : isCircle ? 0 : count - 1;
    };
}
