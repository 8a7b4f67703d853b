// Sets observations over time as a reader does, and prints what the page shows as JSON.
//
// In: the path of a browser, the address of a page whose first question has one truth value at each instant. Out: errors of
// the page, numbers of instants, the last probability after two observations, and after the second one is taken back.

const [browserPath, address] = process.argv.slice(2);
const { chromium } = require("playwright-core");

let axe = null;
try {
    axe = require("fs").readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
} catch {
    // Without the package the rules are not checked.
}

const rows = (page) => page.$$eval("#observations tbody tr", (lines) => lines.length);

/** The last probability once it differs from another. */
async function changed(page, before) {
    const handle = await page.waitForFunction((before) => {
        const cells = [...document.querySelectorAll("#answers tbody tr")].map((line) => line.cells[line.cells.length - 2].textContent);
        const last = cells[cells.length - 1];
        const isBusy = document.getElementById("answers").hasAttribute("aria-busy");
        return last !== undefined && last !== before && !isBusy ? last : null;
    }, before);
    return handle.jsonValue();
}

async function main() {
    const browser = await chromium.launch({ executablePath: browserPath, args: ["--no-sandbox"] });
    const page = await browser.newPage();
    const found = { errors: [] };
    page.on("pageerror", (error) => found.errors.push(error.message));
    await page.goto(address);
    const begun = await changed(page, null);
    found.first = await rows(page);
    await page.click("#shrink");
    await page.click("#shrink");
    found.last = await rows(page);
    await page.selectOption('select[aria-label="Wet at 1"]', { label: "true" });
    await page.selectOption('select[aria-label="Wet at 2"]', { label: "true" });
    // A served page asks for each change; the answer to the last one comes last.
    await page.waitForTimeout(1500);
    found.two = await changed(page, begun);
    await page.selectOption('select[aria-label="Wet at 2"]', { label: "none" });
    found.none = await changed(page, found.two);
    if (axe !== null) {
        await page.evaluate(axe);
        const { violations } = await page.evaluate(() => globalThis.axe.run());
        found.faults = violations.filter(({ impact }) => ["serious", "critical"].includes(impact)).map(({ id }) => id);
    }
    if (process.env.BP_SCREENSHOTS) {
        await page.screenshot({ path: `${process.env.BP_SCREENSHOTS}/instants.png`, fullPage: true });
    }
    await browser.close();
    console.log(JSON.stringify(found));
}

main().catch((error) => {
    console.error(error);
    process.exit(1);
});
