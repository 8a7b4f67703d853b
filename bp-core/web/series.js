// Results of questions over time: functions that are called instant by instant.
//
// In: a question with its runs, the functions, inputs, and the observations of each instant. Out: the results that `answer.js`
// reads. Invariant: an instant without observations is still an instant.

/** What is observed at an instant: a number for each column, or a list for columns of one input, and whether it is given. */
function observedAt({ columns }, { needed, together }, row, at) {
    const given = {};
    const put = (name, element, number) => {
        if (element === undefined) {
            given[name] = number;
        } else {
            given[name] ??= [];
            given[name][element.place] = number;
        }
    };
    for (const { name, value, element } of columns) {
        const own = row[name] ?? null;
        const input = element?.of ?? name;
        const flag = `whether ${input} is given`;
        const isGiven = own === null ? 0 : 1;
        const isTogether = together.includes(input);
        if (isTogether && given[flag] !== undefined && given[flag] !== isGiven) {
            throw new RangeError(`at instant ${at + 1} some numbers of \`${input}\` are missing: give all or none`);
        }
        if (isGiven === 0 && needed.includes(input)) {
            throw new RangeError(`at instant ${at + 1} \`${input}\` is missing: the page computes each instant from it`);
        }
        put(flag, isTogether ? undefined : element, isGiven);
        put(input, element, own ?? value);
    }
    return given;
}

/** The inputs that carry the result of an instant to the next one. */
function carriedBy({ carried, reals }, result) {
    if (reals === 0) {
        return { [carried]: [...result.answers[0]] };
    }
    return Object.fromEntries(result.law.map((number, place) => [`law ${place}`, number]));
}

/** The result of an instant, with arrays of its own. */
function kept(result) {
    return { ...result, answers: result.answers.map((cells) => [...cells]) };
}

/** The results of all instants, one after the other, each given the observations up to it. */
function passed(steps, [first, later], inputs, observed) {
    let before = {};
    return observed.map((own, at) => {
        const result = kept((at === 0 ? first : later)({ ...inputs, ...before, ...own }));
        if (steps.reals > 0 && !Number.isFinite(result.lnEvidence)) {
            throw new RangeError(BEYOND);
        }
        if (result.lnEvidence === -Infinity) {
            throw new RangeError(`the observations are impossible: at instant ${at + 1} their probability is 0`);
        }
        before = carriedBy(steps, result);
        return result;
    });
}

/** ln P(all observations). */
function lnOf(results) {
    return results.reduce((sum, { lnEvidence }) => sum + lnEvidence, 0);
}

/** The last instant, or one that is predicted. */
function lastOf(steps, functions, inputs, observed) {
    if (steps.absent !== null && observed.length + steps.ahead < 2) {
        throw new RangeError(steps.absent);
    }
    const results = passed(steps, functions, inputs, observed);
    const answers = [results[results.length - 1]];
    for (let at = 0; at < steps.ahead; at++) {
        answers.push(kept(functions[2]({ ...inputs, ...carriedBy(steps, answers[at]) })));
    }
    // A predicted instant adds ln of the probability that it has values at all: 0, unless a form leaves values out.
    return { ...answers[steps.ahead], lnEvidence: lnOf(results) + lnOf(answers.slice(1)) };
}

/** Each instant given all observations, of finite states: forward and backward. */
function smoothedStates(steps, [first, later, back, both], inputs, observed) {
    const forward = passed(steps, [first, later], inputs, observed);
    let message = new Array(forward[0].answers[0].length).fill(1);
    const each = [];
    for (let at = forward.length - 1; at >= 0; at--) {
        const given = { ...inputs, ...observed[at], ...carriedBy(steps, forward[at]), [steps.later]: message };
        each[at] = kept(both(given));
        if (at > 0) {
            message = [...back(given).answers[0]];
        }
    }
    return { each, lnEvidence: lnOf(forward) };
}

/** The most likely states of all instants: the place of the value of each carried variable. */
function mostLikely(steps, [first, , , , best, trace], inputs, observed) {
    const forward = passed(steps, [first, best], inputs, observed);
    const places = [];
    let then = {};
    for (let at = forward.length - 1; at >= 0; at--) {
        const carried = carriedBy(steps, forward[at]);
        const isLast = at === forward.length - 1;
        const [cells] = isLast ? forward[at].answers : trace({ ...inputs, ...observed[at + 1], ...carried, ...then }).answers;
        let place = cells.reduce((best, number, place) => (number > cells[best] ? place : best), 0);
        places[at] = {};
        then = {};
        for (const { name, input, numbers } of [...steps.states].reverse()) {
            places[at][name] = place % numbers.length;
            then[input] = numbers[place % numbers.length];
            place = Math.floor(place / numbers.length);
        }
    }
    return places;
}

/** Each instant given all observations, of a normal law: what is carried corrects the instant before. */
function smoothedLaws(steps, functions, inputs, observed) {
    const forward = passed(steps, functions, inputs, observed);
    const each = [];
    let later = null;
    for (let at = forward.length - 1; at >= 0; at--) {
        const { moments } = forward[at];
        // The searched variables come first, then what is carried on, then what was carried to the instant.
        const law = lawOf(moments, countOf(moments.length));
        const [now, before] = [law.mean.length - 2 * steps.reals, law.mean.length - steps.reals];
        const smoothed = later === null ? law : corrected(law, now, later);
        each[at] = { moments: momentsOf(smoothed, 0, now) };
        later = lawOf(momentsOf(smoothed, before, before + steps.reals), steps.reals);
    }
    return { each, lnEvidence: lnOf(forward) };
}

/** The result of a run over time; `rows` has the observations of each instant. What is absent or null is not observed. */
function followed(instants, steps, functions, inputs, rows) {
    const observed = rows.map((row, at) => observedAt(instants, steps, row, at));
    if (steps.way === "last") {
        return lastOf(steps, functions, inputs, observed);
    }
    const result = (steps.reals > 0 ? smoothedLaws : smoothedStates)(steps, functions, inputs, observed);
    const named = result.each.map((own, at) => ({ ...own, instant: String(at + 1) }));
    if (steps.way === "sequence") {
        mostLikely(steps, functions, inputs, observed).forEach((places, at) => {
            named[at].places = places;
        });
    }
    const shown = steps.absent === null ? named : named.slice(1);
    if (shown.length === 0) {
        throw new RangeError(steps.absent);
    }
    return { ...result, each: shown };
}

/** The results of the runs of a question for the values of its controls, and observations over time. */
function resultsOf(question, functions, values, rows) {
    const inputs = inputsOf(question, values);
    return question.runs.map(({ functions: names, steps }) => {
        const own = names.map((name) => functions[name]);
        return steps === null ? own[0](inputs) : followed(question.instants, steps, own, inputs, rows);
    });
}
