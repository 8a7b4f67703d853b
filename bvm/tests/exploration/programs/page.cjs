// Opens a page in headless Chromium without network, uses its controls, and prints what it found as JSON.
// node page.cjs PAGE CHROMIUM SCREENSHOT
const { chromium } = require("playwright-core");

(async () => {
    const [page_path, executablePath, screenshot] = process.argv.slice(2);
    const args = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
        "--disable-component-update", "--disable-sync"];
    const browser = await chromium.launch({ executablePath, args });
    const context = await browser.newContext({ offline: true, viewport: { width: 1120, height: 900 } });
    const page = await context.newPage();
    const found = { errors: [], requests: [] };
    page.on("pageerror", (error) => found.errors.push(String(error)));
    page.on("console", (message) => message.type() === "error" && found.errors.push(message.text()));
    page.on("request", (request) => found.requests.push(request.url()));
    await page.goto(`file://${page_path}`);
    found.drawn = await page.evaluate(() => document.body.dataset.drawn);
    found.title = await page.title();
    found.figures = await page.evaluate(() => [...document.querySelectorAll("#figures tr")].map((row) => row.innerText));
    found.senses = await page.evaluate(() => [...document.querySelectorAll("#senses tr")].map((row) => row.innerText));
    // The colours of a canvas: one colour alone would be an empty drawing.
    const colours = (id) => page.evaluate((id) => {
        const canvas = document.getElementById(id);
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        return new Set(new Uint32Array(data.buffer)).size;
    }, id);
    const picture = (id) => page.evaluate((id) => document.getElementById(id).toDataURL(), id);
    found.colours = {};
    for (const id of ["curves", "cloud", "panorama", "information"]) found.colours[id] = await colours(id);
    await page.screenshot({ path: screenshot, fullPage: true });
    const before = await picture("cloud");
    await page.locator("#cloud").scrollIntoViewIfNeeded();
    const box = await page.locator("#cloud").boundingBox();
    await page.mouse.move(box.x + 300, box.y + 200);
    await page.mouse.down();
    await page.mouse.move(box.x + 420, box.y + 230, { steps: 4 });
    await page.mouse.up();
    const turned = await picture("cloud");
    found.turns = turned !== before;
    await page.mouse.wheel(0, -400);
    await page.waitForTimeout(100);
    found.zooms = (await picture("cloud")) !== turned;
    const last = await picture("panorama");
    await page.locator("#when").fill("0");
    found.goes_back = (await picture("panorama")) !== last;
    const first = await picture("curves");
    await page.locator("input[value=occupancy_entropy]").check();
    found.chooses = (await picture("curves")) !== first;
    await browser.close();
    console.log(JSON.stringify(found));
})().catch((error) => {
    console.error(error);
    process.exit(1);
});
