/** The page in Chromium: values beside Python's, clicks, files, messages, keys. */

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";
import { after, before, describe, test } from "node:test";
import { gzipSync } from "node:zlib";
import {
  folder,
  launch,
  missing,
  open,
  openSample,
  PAGE,
  picture,
  reference,
  saved,
  finished,
} from "./browser.mjs";

/** The engine multiplies and adds in two roundings: curvatures differ by at most this share of max(|k|, 1/r). */
const SAME = 2e-5;

/** The same at borders, where all points are on one side. */
const SAME_AT_BORDERS = 3e-4;

const reason = missing();

test("the page is small", { skip: reason !== null && reason }, () => {
  assert.ok(gzipSync(readFileSync(PAGE)).length < 1.5e6);
  assert.ok(readFileSync(PAGE).length < 2e6);
});

describe("the page in Chromium", { concurrency: 2, skip: reason !== null && reason }, () => {
  let browser;
  before(async () => {
    browser = await launch();
  });
  after(() => browser.close());

  /** Asserts that the values that the page saves are Python's. */
  function assertCurvature(file, radius, ...query) {
    const {
      points,
      oriented,
      statuses_differ,
      counts_differ,
      one_sided,
      zeta = 0,
      ...differences
    } = reference("curvature", file, radius, ...query);
    assert.ok(points > 50_000 && oriented);
    assert.ok(counts_differ <= points / 5_000, `${counts_differ} counts differ`);
    assert.ok(one_sided < SAME_AT_BORDERS, `at borders: ${one_sided}`);
    assert.ok(statuses_differ <= points / 10_000, `${statuses_differ} statuses differ`);
    for (const [name, difference] of Object.entries(differences)) {
      assert.ok(difference !== null && difference < SAME, `${name}: ${difference}`);
    }
    assert.ok(zeta < 1e-4, `zeta: ${zeta}`);
  }

  test("curvature is Python's", async (context) => {
    const { page, wrong } = await open(browser);
    await openSample(page, "pipes");
    await picture(page, "pipes");
    assertCurvature(await saved(page, "#save-ply", path.join(folder(context), "saved.ply")), "0.08");
    assert.deepEqual(wrong, []);
    await page.close();
  });

  test("a click compares with all points, a second one with the first, and surfaces are Python's", async (context) => {
    const { page, wrong } = await open(browser);
    await openSample(page, "parts");
    const view = await page.locator("#view").boundingBox();
    await page.mouse.click(view.x + 0.29 * view.width, view.y + 0.5 * view.height);
    await finished(page, "zeta");
    await page.waitForSelector("#alike");
    await page.keyboard.down("Shift");
    await page.mouse.click(view.x + 0.69 * view.width, view.y + 0.5 * view.height);
    await page.keyboard.up("Shift");
    const told = await page.locator("#zeta strong").textContent();
    assert.match(told, /^[01]\.\d{3} \((optimal|good|dissimilar)\)$/);
    await picture(page, "zeta");
    const files = folder(context);
    await page.click("#save-link");
    const { point } = JSON.parse(decodeURIComponent(new URL(page.url()).hash.slice(1)));
    assertCurvature(await saved(page, "#save-ply", path.join(files, "zeta.ply")), "0.012", point);

    await page.click("#find");
    await page.waitForSelector("#surface-table");
    await finished(page, "surface");
    const rows = page.locator("#surface-table tbody tr");
    await rows.nth(1).click();
    await rows.nth(2).click({ modifiers: ["Shift"] });
    assert.equal(await page.locator('#surface-table tr[aria-selected="true"]').count(), 2);
    await page.getByText("Surfaces 1 and 2").waitFor();
    await picture(page, "surfaces");
    const table = await saved(page, "#save-csv", path.join(files, "surfaces.csv"));
    const points = await saved(page, "#save-ply", path.join(files, "surfaces.ply"));
    const found = reference("surfaces", points, table);
    assert.deepEqual(found.kinds, found.python_kinds);
    assert.ok(found.labels_differ < 400, `${found.labels_differ} labels differ`);
    assert.ok(found.radius < 1e-4 && found.interval < 1e-2, JSON.stringify(found));
    const json = JSON.parse(
      readFileSync(await saved(page, "#save-json", path.join(files, "surfaces.json")), "utf8"),
    );
    assert.equal(json.surfaces.length, found.kinds.length);

    // A click into the view chooses the row.
    await page.keyboard.press("Escape");
    assert.equal(await page.locator('#surface-table tr[aria-selected="true"]').count(), 0);
    await page.mouse.click(view.x + 0.29 * view.width, view.y + 0.5 * view.height);
    await page.waitForSelector('#surface-table tr[aria-selected="true"]');
    assert.deepEqual(wrong, []);
    await page.close();
  });

  test("of many points some are drawn at once, and more when nothing moves", async (context) => {
    const file = path.join(folder(context), "many.ply");
    const side = 400;
    const header = `ply\nformat binary_little_endian 1.0\nelement vertex ${side * side}\n`;
    const properties = ["x", "y", "z"].map((axis) => `property float ${axis}\n`).join("");
    const rows = Float32Array.from({ length: 3 * side * side }, (_, i) => {
      const point = Math.floor(i / 3);
      return [point % side, Math.floor(point / side), 0][i % 3];
    });
    writeFileSync(
      file,
      Buffer.concat([Buffer.from(`${header}${properties}end_header\n`), Buffer.from(rows.buffer)]),
    );
    const { page, wrong } = await open(browser);
    await page.evaluate(() => {
      window.drawn = [];
      const element = document.querySelector("#drawn");
      const note = () => window.drawn.push(parseInt(element.textContent.replaceAll(",", "")));
      new MutationObserver(note).observe(element, { childList: true });
    });
    await page.setInputFiles("#file", file);
    await finished(page, "mean_curvature");
    await page.waitForFunction(() => window.drawn.at(-1) > 1.3 * window.drawn[0]);
    assert.ok((await page.evaluate(() => window.drawn[0])) < side * side);
    assert.deepEqual(wrong, []);
    await page.close();
  });

  test("every format gives its points, and a broken file its reason", async (context) => {
    const files = folder(context);
    const { broken, sum } = reference("files", files);
    const { page, wrong } = await open(browser);
    const names = ["cloud.ply", "ascii.ply", "cloud.pcd", "ascii.pcd", "cloud.las", "cloud.laz"];
    names.push("cloud.xyz", "cloud.csv", "lines.obj", "far.ply");
    const savedFiles = [];
    for (const name of names) {
      await page.setInputFiles("#file", path.join(files, name));
      await page.getByText(name, { exact: true }).waitFor();
      await finished(page, "mean_curvature");
      savedFiles.push(await saved(page, "#save-ply", path.join(files, `saved_${name}.ply`)));
    }
    reference("saved", ...savedFiles).forEach((back, number) => {
      const name = names[number];
      assert.equal(back.points, 400, name);
      const offset = name.startsWith("far") ? [160_000_000, 2_240_000_000, 120_000] : [0, 0, 0];
      back.sum.forEach((value, axis) => {
        assert.ok(Math.abs(value - offset[axis] - sum[axis]) < 0.3, `${name}: ${back.sum}`);
      });
      if (/(cloud.ply|pcd)$/.test(name)) assert.deepEqual(back.viewpoint, [0, 0, 5], name);
    });
    for (const name of broken) {
      await page.setInputFiles("#file", path.join(files, name));
      const message = page.locator("#message span");
      await message.filter({ hasText: name }).waitFor();
      assert.ok((await message.textContent()).length > name.length + 15);
    }
    await picture(page, "message");
    // The page goes on.
    const data = await page.evaluateHandle(() => {
      const transfer = new DataTransfer();
      const rows = Array.from(
        { length: 900 },
        (_, i) => `${i % 30} ${Math.floor(i / 30)} ${0.01 * (i % 30) ** 2}`,
      );
      transfer.items.add(new File([rows.join("\n")], "dropped.xyz"));
      return transfer;
    });
    await page.dispatchEvent("#stage-area", "drop", { dataTransfer: data });
    await page.getByText("dropped.xyz", { exact: true }).waitFor();
    await finished(page, "mean_curvature");
    assert.deepEqual(wrong, []);
    await page.close();
  });

  test("the radius, auto, a link, keys, and cancelling", async (context) => {
    const { page, wrong } = await open(browser);
    await openSample(page, "waves");
    assertCurvature(await saved(page, "#save-ply", path.join(folder(context), "saved.ply")), "0.2");
    await page.locator("#radius").focus();
    await page.keyboard.press("ArrowRight");
    await finished(page, "mean_curvature");
    const radius = await page.locator("#radius-value").textContent();
    await page.selectOption("#quantity", "class");
    await picture(page, "class");
    await page.click("#save-link");
    const linked = page.url();
    await page.goto("about:blank");
    await page.goto(linked);
    await finished(page, "class");
    assert.equal(await page.locator("#radius-value").textContent(), radius);
    await page.check("#auto");
    await page.waitForSelector("#progress:not([hidden])");
    await page.click("#stop");
    await finished(page);
    assert.equal(await page.locator("#message").isVisible(), false);
    await page.keyboard.press("Escape");
    await page.locator("#view").focus();
    const camera = async () => {
      await page.click("#save-link");
      return JSON.parse(decodeURIComponent(new URL(page.url()).hash.slice(1))).view.position;
    };
    const before = await camera();
    await page.keyboard.press("ArrowLeft");
    await page.keyboard.press("+");
    assert.notDeepEqual(await camera(), before);
    await page.keyboard.press("1");
    assert.equal(await page.locator("#quantity").inputValue(), "mean_curvature");
    await page.keyboard.press("?");
    assert.ok(await page.locator("#help").isVisible());
    await page.keyboard.press("Escape");
    assert.equal(await page.locator("#help").isVisible(), false);
    assert.deepEqual(wrong, []);
    await page.close();
  });

  test("a report shows its table, and a row chooses its points", async (context) => {
    const file = path.join(folder(context), "report.html");
    const { surfaces, rows } = reference("report", file);
    const { page, wrong } = await open(browser, {}, pathToFileURL(file).href);
    await page.waitForSelector("#report-table");
    assert.equal(await page.title(), "Plane & <ball>");
    const shown = await page.locator("#report-table tbody tr").allInnerTexts();
    assert.equal(shown.length, rows.length);
    shown.forEach((text, i) => rows[i].forEach((word) => assert.ok(text.includes(word), `${text}: ${word}`)));
    await page
      .locator("#report-table tbody tr")
      .nth(surfaces - 1)
      .click();
    assert.equal(await page.locator('#report-table tr[aria-selected="true"]').count(), 1);
    assert.equal(await page.locator("#find").isVisible(), false);
    await picture(page, "report");
    assert.deepEqual(wrong, []);
    await page.close();
  });

  test("everything has a name, in the dark and on a phone too", async () => {
    const { page, wrong } = await open(browser, {
      viewport: { width: 390, height: 800 },
      colorScheme: "dark",
      hasTouch: true,
    });
    await picture(page, "phone_start");
    await openSample(page, "pipes");
    await picture(page, "phone");
    const nameless = await page.evaluate(() =>
      [...document.querySelectorAll("button, input, select, a, canvas, dialog")]
        .filter(
          (e) =>
            !(
              e.getAttribute("aria-label") ||
              e.getAttribute("aria-labelledby") ||
              e.textContent.trim() ||
              e.labels?.length > 0
            ),
        )
        .map((e) => e.outerHTML),
    );
    assert.deepEqual(nameless, []);
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), true);
    const back = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    assert.equal(back, "rgb(20, 24, 29)");
    assert.deepEqual(wrong, []);
    await page.close();
  });
});
