// Types numbers beside sliders as a reader does, and prints what the page shows as JSON.
//
// In: the path of a browser, the address of the page of the program of `typed.rs`. Out: errors of the page, and for each thing that
// is typed what the box, the slider, the message and the answer are then.

const [browserPath, address] = process.argv.slice(2);
const { chromium } = require("playwright-core");

/** What the page shows of a control, and the answer. */
async function shown(page, label) {
    await page.waitForTimeout(150);
    return page.evaluate((label) => {
        const place = [...document.querySelectorAll(".control")].find((one) => one.querySelector("label").textContent === label);
        const [box, slider] = [place.querySelector("input[type=number]"), place.querySelector("input[type=range]")];
        const text = (all) => [...all].map((one) => one.textContent);
        return {
            box: Number(box.value),
            slider: [slider.min, slider.value, slider.max].map(Number),
            message: place.querySelector(".error").textContent,
            error: text(document.querySelectorAll("#answers .error")).join(" "),
            heads: text(document.querySelectorAll("#answers th")),
            cells: text(document.querySelectorAll("#answers tbody td:not(.bar)")),
        };
    }, label);
}

const box = (label) => `input[aria-label="${label}, as a number"]`;

async function main() {
    const browser = await chromium.launch({ executablePath: browserPath, args: ["--no-sandbox"] });
    const page = await browser.newPage();
    const found = { errors: [] };
    page.on("pageerror", (error) => found.errors.push(error.message));
    await page.goto(address);
    await page.waitForFunction(() => document.querySelectorAll("#answers .answer").length > 0);
    found.first = await shown(page, "Y");
    await page.fill(box("Y"), "50");
    found.far = await shown(page, "Y");
    await page.focus(`.control:has(${box("Y")}) input[type=range]`);
    await page.keyboard.press("ArrowLeft");
    found.left = await shown(page, "Y");
    await page.fill(box("Y"), "-1e200");
    found.beyond = await shown(page, "Y");
    await page.click("#reset");
    found.again = await shown(page, "Y");
    await page.fill(box("noise"), "-1");
    found.noise = await shown(page, "noise");
    await page.fill(box("noise"), "0.5");
    await page.fill(box("gap"), "-3");
    found.gap = await shown(page, "gap");
    await page.fill(box("gap"), "1");
    await page.selectOption("#question", { index: 1 });
    found.both = await shown(page, "noise");
    await page.selectOption("#question", { index: 2 });
    await page.waitForTimeout(150);
    found.rows = await page.$$eval("#observations tbody tr", (lines) => lines.length);
    await page.click("#grow");
    found.over = await shown(page, "hit");
    await page.fill(box("hit"), "1.5");
    found.hit = await shown(page, "hit");
    await browser.close();
    console.log(JSON.stringify(found));
}

main().catch((error) => {
    console.error(error);
    process.exit(1);
});
