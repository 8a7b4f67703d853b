// Edits a program while the answer of the earlier one is still computed, and prints what the page shows as JSON.
//
// In: the path of a browser, the address of a page whose only question has one real as evidence, the text of a second
// program. Out: texts of the page.

const [browserPath, address, second] = process.argv.slice(2);
const { chromium } = require("playwright-core");

const answer = (page) => page.$eval("#answers tbody tr td:last-child", (cell) => cell.textContent);

/** Waits until an answer other than the one before is shown. */
async function changed(page, before) {
    await page.waitForFunction((before) => {
        const cell = document.querySelector("#answers tbody tr td:last-child");
        return cell !== null && cell.textContent !== before && !document.getElementById("answers").hasAttribute("aria-busy");
    }, before);
    return answer(page);
}

async function main() {
    const browser = await chromium.launch({ executablePath: browserPath, args: ["--no-sandbox"] });
    const page = await browser.newPage();
    const found = { errors: [] };
    page.on("pageerror", (error) => found.errors.push(error.message));
    // The page forgets its requests by itself: one that is given up is answered all the same.
    await page.addInitScript(() => {
        const ask = globalThis.fetch;
        globalThis.delay = 0;
        globalThis.busy = false;
        globalThis.fetch = async (path, { signal, ...request }) => {
            if (path === "ask" && globalThis.busy) {
                globalThis.busy = false;
                return new Response("{}", { status: 503, headers: { "Retry-After": "1" } });
            }
            const pause = path === "ask" ? globalThis.delay : 0;
            const response = await ask(path, request);
            await new Promise((done) => setTimeout(done, pause));
            return response;
        };
    });
    await page.goto(address);
    found.first = await changed(page, null);
    found.file = await page.getAttribute("#download", "download");
    const first = await page.inputValue("#source");
    // The first program is asked, slowly; before its answer comes the second is typed.
    await page.evaluate(() => {
        globalThis.delay = 2000;
    });
    await page.click("#reset");
    await page.waitForFunction(() => document.getElementById("waiting").textContent !== "");
    found.waiting = await page.textContent("#waiting");
    await page.waitForTimeout(100);
    await page.evaluate(() => {
        globalThis.delay = 0;
    });
    await page.fill("#source", second);
    found.edited = await changed(page, found.first);
    await page.waitForTimeout(2500);
    found.late = await answer(page);
    await page.fill("#controls input[type=number]", "2");
    found.moved = await changed(page, found.edited);
    await page.fill("#source", first);
    const kept = await changed(page, found.moved);
    found.kept = [await page.inputValue("#controls input[type=number]"), kept];
    await page.fill("#controls input[type=number]", "");
    found.empty = await page.textContent("#controls .error");
    await page.evaluate(() => {
        globalThis.busy = true;
    });
    await page.fill("#source", second);
    found.busy = await changed(page, kept);
    const other = await browser.newPage();
    await other.goto(`${address}#p=damaged`);
    await other.waitForFunction(() => document.getElementById("link").textContent !== "");
    found.damaged = await other.textContent("#link");
    await browser.close();
    console.log(JSON.stringify(found));
}

main().catch((error) => {
    console.error(error);
    process.exit(1);
});
