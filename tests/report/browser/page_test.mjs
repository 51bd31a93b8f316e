// report.html in headless Chromium: no console errors, no requests, curves drawn, the slider moves the fines, the clip plane cuts, and the page says
// everything with scripts off and without WebGL. Usage: node page_test.mjs <report.html> [folder for screenshots]
// Exit code 77 (skipped) with a message where playwright-core or Chromium is absent: npm install playwright-core; apt-get install chromium.
import { createRequire } from "node:module";
import { existsSync } from "node:fs";
import path from "node:path";
import process from "node:process";

const [page_file, pictures] = process.argv.slice(2);
function skip(why) { console.log("SKIPPED: " + why); process.exit(77); }

// Found as node finds modules from the folder the test runs in, or in NODE_PATH.
let chromium;
try {
    ({ chromium } = createRequire(path.resolve("x.js"))("playwright-core"));
} catch {
    skip("playwright-core is not installed (npm install playwright-core)");
}
const browser_file = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find((file) => file && existsSync(file));
if (!browser_file) skip("no Chromium found (apt-get install chromium, or name it in CHROMIUM)");

let failures = 0;
function check(what, holds) {
    console.log((holds ? "ok      " : "FAILED  ") + what);
    if (!holds) ++failures;
}

const address = "file://" + path.resolve(page_file);
async function visit(args, options, visitor) {
    const browser = await chromium.launch({ executablePath: browser_file, args: ["--no-sandbox", ...args] });
    const page = await (await browser.newContext({ viewport: { width: 1200, height: 900 }, offline: true, ...options })).newPage();
    page.setDefaultTimeout(120000);
    const errors = [], requests = [];
    page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
    page.on("pageerror", (error) => errors.push(String(error)));
    page.on("request", (request) => { if (request.url() !== address && !/^(data|blob):/.test(request.url())) requests.push(request.url()); });
    await page.goto(address);
    await visitor(page, errors, requests);
    await browser.close();
}
async function shot(page, name, selector) {
    if (!pictures) return;
    const file = path.join(pictures, name + ".png");
    await (selector ? page.locator(selector).first().screenshot({ path: file }) : page.screenshot({ path: file, fullPage: true }));
}
const software_gl = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];

await visit(software_gl, {}, async (page, errors, requests) => {
    await page.waitForSelector("body[data-viewer=ready]");
    const drawn = await page.evaluate(() => Array.from(document.querySelectorAll("#charts .plot")).map((plot) => {
        const canvases = Array.from(plot.querySelectorAll("canvas"));
        return canvases.some((canvas) => canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.some((value) => value !== 0));
    }));
    check(drawn.length + " charts are drawn", drawn.length > 0 && drawn.every(Boolean));
    check("legends name the curves", await page.evaluate(() => Array.from(document.querySelectorAll("#charts .legend")).every((legend) => legend.textContent.trim().length > 0)));

    // A drag across a chart zooms: fewer seconds between the ends of the axis.
    const labels = () => page.evaluate(() => Array.from(document.querySelector("#charts .plot").querySelectorAll(".dygraph-axis-label-x")).map((label) => Number(label.textContent)));
    const before = await labels();
    await page.locator("#charts .plot").first().scrollIntoViewIfNeeded();
    const box = await page.locator("#charts .plot").first().boundingBox();
    await page.mouse.move(box.x + 0.4 * box.width, box.y + 0.5 * box.height);
    await page.mouse.down();
    await page.mouse.move(box.x + 0.6 * box.width, box.y + 0.5 * box.height, { steps: 4 });
    await page.mouse.up();
    const after = await labels();
    check("a drag zooms into a chart", Math.max(...after) - Math.min(...after) < Math.max(...before) - Math.min(...before));

    const canvas = "#viewer canvas";
    await page.locator(canvas).scrollIntoViewIfNeeded();
    const pixels = async () => {
        await page.waitForTimeout(1500);  // one frame of the software renderer
        return page.evaluate((selector) => {
            const source = document.querySelector(selector), copy = document.createElement("canvas");
            copy.width = source.width;
            copy.height = source.height;
            const context = copy.getContext("2d");
            context.drawImage(source, 0, 0);
            return Array.from(context.getImageData(0, 0, copy.width, copy.height).data);
        }, canvas);
    };
    const differing = (a, b) => a.reduce((sum, value, i) => sum + (Math.abs(value - b[i]) > 16 ? 1 : 0), 0);
    const set = (id, value) => page.evaluate(([name, to]) => {
        const input = document.getElementById(name);
        input.value = to;
        input.dispatchEvent(new Event("input"));
    }, [id, String(value)]);
    const end = await pixels();
    check("the 3-D view is not blank", new Set(end.filter((_, i) => i % 4 === 0)).size > 16);
    await shot(page, "viewer_end", "#viewer");
    const end_time = await page.textContent("#view-time");
    await set("view-frame", 0);
    const start = await pixels();
    check("the time slider moves the fines", differing(end, start) > 200);
    check("and tells the time", (await page.textContent("#view-time")) !== end_time);
    await set("view-cut", 50);
    check("the clip plane cuts", differing(start, await pixels()) > 1000);
    await shot(page, "viewer_cut", "#viewer");
    check("no console errors" + (errors.length ? ": " + errors.join("; ") : ""), errors.length === 0);
    check("no requests" + (requests.length ? ": " + requests.join(" ") : ""), requests.length === 0);
    await shot(page, "page");
});

const says_all = async (page) => {
    check("figures are shown", (await page.locator("figure img").count()) > 0 && await page.locator("figure img").first().isVisible());
    for (const id of ["figures", "numbers", "setup", "criteria", "balances", "history"]) check("section " + id, await page.locator("#" + id).isVisible());
    check("links to the data", (await page.locator("a[href$='.csv']").count()) > 0);
};
console.log("scripts off");
await visit([], { javaScriptEnabled: false }, async (page) => { await says_all(page); await shot(page, "no_script"); });
console.log("without WebGL");
await visit(["--disable-gpu", "--disable-3d-apis", "--disable-webgl", "--disable-webgl2"], {}, async (page) => {
    await says_all(page);
    check("says that the view is off", (await page.textContent("#viewer-message")).includes("WebGL"));
    check("charts are drawn all the same", (await page.locator("#charts .plot canvas").count()) > 0);
});
console.log("narrow");
await visit(software_gl, { viewport: { width: 500, height: 800 } }, async (page) => {
    check("no sideways scroll at 500 px", await page.evaluate(() => document.documentElement.scrollWidth <= document.documentElement.clientWidth));
});
process.exit(failures ? 1 : 0);
