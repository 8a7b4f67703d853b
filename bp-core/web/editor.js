// The editor of `bp serve`: the text of a program, its mistakes, and the page of the last text without mistakes.
//
// In: what is typed. Out: requests to the server that sent the page, and to no other. Invariant: an answer of the server is
// shown only if it belongs to the text that was sent last; the fragment of the address holds the text.

const source = byId("source");
const under = byId("under");

/** The milliseconds after a key before the text is sent. */
const PAUSE = 250;

/** The text that the server holds, and the name of its file. */
const own = JSON.parse(byId("data").textContent);

let compiling = null;
/** The name of a question that was asked last and is shown once it is compiled. */
let wanted = null;
let timer = 0;
let file = "program";

/** Posts an object as JSON; the answer is an object too. An error of the server is an `Error`; a busy server is asked again. */
async function post(path, body, signal) {
    const response = await fetch(path, {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify(body),
        signal,
    });
    const pause = response.headers.get("Retry-After");
    if (pause !== null) {
        await response.text();
        await new Promise((done) => setTimeout(done, 1000 * Number(pause)));
        signal.throwIfAborted();
        return post(path, body, signal);
    }
    const found = await response.json();
    if (!response.ok) {
        throw new Error(found.error);
    }
    return found;
}

/** Bytes through a stream that compresses or expands them. */
async function through(bytes, stream) {
    const piped = new Blob([bytes]).stream().pipeThrough(stream);
    return new Uint8Array(await new Response(piped).arrayBuffer());
}

/** A text as a fragment: compressed, in base64 for addresses. */
async function toFragment(text) {
    const bytes = await through(new TextEncoder().encode(text), new CompressionStream("deflate-raw"));
    const letters = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
    return `#p=${letters.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "")}`;
}

/** The text of a fragment; null if it holds none. A damaged fragment is reported, and holds none. */
async function fromFragment(fragment) {
    byId("link").textContent = "";
    if (!fragment.startsWith("#p=")) {
        return null;
    }
    try {
        const letters = atob(fragment.slice(3).replaceAll("-", "+").replaceAll("_", "/"));
        const bytes = Uint8Array.from(letters, (letter) => letter.charCodeAt(0));
        return new TextDecoder("utf-8", { fatal: true }).decode(await through(bytes, new DecompressionStream("deflate-raw")));
    } catch {
        byId("link").textContent = "The link is damaged: the program that it held cannot be read. Another program is shown.";
        return null;
    }
}

/** Underlines mistakes in the text behind the editor, and lists them. */
function mark(mistakes) {
    const text = source.value;
    const pieces = [];
    let at = 0;
    for (const { start, end } of [...mistakes].sort((one, other) => one.start - other.start)) {
        if (start < at) {
            continue;
        }
        const last = Math.max(end, start + 1);
        pieces.push(text.slice(at, start), element("mark", {}, text.slice(start, last) || " "));
        at = last;
    }
    under.replaceChildren(...pieces, text.slice(at), "\n");
    under.scrollTop = source.scrollTop;
    under.scrollLeft = source.scrollLeft;
    byId("mistakes").replaceChildren(...mistakes.map((mistake) => {
        const place = element("button", { type: "button" }, `Line ${mistake.line}: ${mistake.message}`);
        place.addEventListener("click", () => {
            source.focus();
            source.setSelectionRange(mistake.start, Math.max(mistake.end, mistake.start + 1));
        });
        return element("li", {}, place);
    }));
}

/** Sends the text, and shows what the server finds. */
async function compile() {
    // The server ends the work for a request that is given up.
    compiling?.abort();
    const asked = new AbortController();
    compiling = asked;
    const text = source.value;
    byId("state").textContent = "Reading the program …";
    let found;
    try {
        found = await post("compile", { text }, asked.signal);
    } catch (error) {
        if (compiling === asked) {
            byId("state").textContent = error.message;
        }
        return;
    }
    if (compiling !== asked) {
        return;
    }
    mark(found.mistakes);
    const count = found.mistakes.length;
    byId("state").textContent = count === 0 ? "No mistakes." : `${count} ${count === 1 ? "mistake" : "mistakes"}.`;
    history.replaceState(null, "", await toFragment(text));
    if (found.program === null) {
        return;
    }
    const address = URL.createObjectURL(new Blob([found.code], { type: "text/javascript" }));
    try {
        const functions = await import(address);
        if (compiling === asked) {
            found.program.file = file;
            show(found.program, functions, (question, given, signal) => elsewhere(text, question, given, signal));
            const place = found.program.questions.findIndex(({ name }) => name === wanted);
            wanted = null;
            if (place >= 0) {
                choose(place);
            }
        }
    } finally {
        URL.revokeObjectURL(address);
    }
}

/** The answers of a question that the server computes. */
async function elsewhere(text, question, given, signal) {
    try {
        return await post("ask", { text, question, ...given }, signal);
    } catch (error) {
        return [{ text: "", error: error.message }];
    }
}

/** Writes a question at the end of the program, and asks it. */
function ask(question) {
    const text = source.value;
    const end = text.lastIndexOf("}");
    if (end < 0) {
        return;
    }
    let number = 1;
    while (text.includes(`question asked_${number} `)) {
        number++;
    }
    wanted = `asked_${number}`;
    const before = text.slice(0, end).trimEnd();
    source.value = `${before}\n    question ${wanted} { ${question} }\n${text.slice(end)}`;
    source.scrollTop = source.scrollHeight;
    clearTimeout(timer);
    compile();
}

byId("asking").addEventListener("submit", (event) => {
    event.preventDefault();
    const question = byId("asked").value.trim();
    if (question !== "") {
        byId("asked").value = "";
        ask(question);
    }
});
source.addEventListener("input", () => {
    mark([]);
    byId("link").textContent = "";
    clearTimeout(timer);
    timer = setTimeout(compile, PAUSE);
});
source.addEventListener("scroll", () => {
    under.scrollTop = source.scrollTop;
    under.scrollLeft = source.scrollLeft;
});
window.addEventListener("hashchange", async () => {
    const text = await fromFragment(location.hash);
    if (text !== null && text !== source.value) {
        source.value = text;
        file = text === own.text ? own.file : "program";
        await compile();
    }
});

const linked = await fromFragment(location.hash);
source.value = linked ?? own.text;
file = source.value === own.text ? own.file : "program";
await compile();
