/** The page's elements: the view with its legend and marks, the panel beside it, messages and progress. */

import type { Actions, Panel } from "./panels/actions.js";
import { colourPanel, Legend } from "./panels/colour.js";
import { curvaturePanel } from "./panels/curvature.js";
import { button, h } from "./panels/dom.js";
import { helpDialog } from "./panels/help.js";
import { pointPanel } from "./panels/point.js";
import { reportPanel } from "./panels/report.js";
import { savePanel } from "./panels/save.js";
import { scanPanel } from "./panels/scan.js";
import { surfacesPanel } from "./panels/surfaces.js";
import { fileChooser, welcome } from "./panels/welcome.js";
import { listen, type Target } from "./input.js";
import { count } from "./numbers.js";
import type { Report } from "./report_data.js";
import type { State } from "./state.js";
import type { Viewer } from "./view/viewer.js";

export interface Frame {
  readonly canvas: HTMLCanvasElement;
  readonly legend: Legend;
  /** Listens to pointer, keys and dropped files. */
  listen(viewer: Viewer, target: Target): void;
  /** Shows a message; "" takes it away. */
  tell(message: string): void;
  showProgress(share: number): void;
  showDrawn(drawn: number, total: number): void;
  placeMarks(places: ([number, number] | null)[]): void;
  addReport(report: Report, setStage: (share: number) => void): void;
  copy(link: string): void;
  update(): void;
}

export function frame(root: HTMLElement, state: State, actions: Actions): Frame {
  const canvas = h("canvas", {
    id: "view",
    tabindex: 0,
    role: "img",
    "aria-label":
      "The points in a view that turns. Arrow keys turn it, plus and minus come nearer, ? shows all keys.",
  });
  const legend = new Legend();
  const marks = ["A", "B"].map((letter, i) =>
    h("span", { class: i === 0 ? "pin" : "pin second", "aria-hidden": "true" }, letter),
  );
  const drawnText = h("div", { id: "drawn" });
  const bar = h("div", { class: "done" });
  const running = h("span", {});
  const progress = h(
    "div",
    { id: "progress", role: "status" },
    running,
    h(
      "div",
      {
        class: "track",
        role: "progressbar",
        "aria-label": "Progress",
        "aria-valuemin": 0,
        "aria-valuemax": 100,
      },
      bar,
    ),
    button("Stop", () => actions.cancel(), { id: "stop", title: "Esc" }),
  );
  const messageText = h("span", {});
  const message = h(
    "div",
    { id: "message", role: "alert" },
    messageText,
    button("×", () => tell(""), { "aria-label": "Close the message" }),
  );
  const chooser = fileChooser(actions);
  const help = helpDialog();
  const start = welcome(actions, () => chooser.click());
  const openButton = button("Open", () => chooser.click(), { title: "Another file" });
  const header = h(
    "header",
    {},
    h(
      "a",
      { class: "name", href: location.href.split("#")[0], "aria-label": "surfsig, from the start" },
      "surfsig",
    ),
    h(
      "nav",
      { "aria-label": "Page" },
      openButton,
      button("Fit", () => actions.fit(), { title: "See all points (F)" }),
      button("Theme", () => switchTheme(), { title: "Light or dark" }),
      button("?", () => help.showModal(), { "aria-label": "Help" }),
    ),
  );
  const panels: Panel[] = [
    scanPanel(state, actions),
    curvaturePanel(state, actions),
    colourPanel(state, actions),
    pointPanel(state, actions),
    surfacesPanel(state, actions),
    savePanel(state, actions),
  ];
  const aside = h(
    "aside",
    { id: "panel", "aria-label": "Scan, curvature, surfaces" },
    header,
    ...panels.map(({ element }) => element),
  );
  const view = h(
    "main",
    { id: "stage-area" },
    canvas,
    legend.element,
    drawnText,
    ...marks,
    progress,
    message,
    start,
    chooser,
  );
  root.replaceChildren(view, aside, help);
  legend.element.hidden = true;
  message.hidden = true;
  let viewer: Viewer | null = null;
  let inReport = false;

  function tell(words: string): void {
    messageText.textContent = words;
    message.hidden = words === "";
  }
  function setBackground(): void {
    viewer?.setBackground(getComputedStyle(view).backgroundColor);
  }
  function switchTheme(): void {
    const dark =
      document.documentElement.dataset.theme ??
      (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
    document.documentElement.dataset.theme = dark === "dark" ? "light" : "dark";
    setBackground();
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", setBackground);

  return {
    canvas,
    legend,
    tell,
    listen(of: Viewer, target: Target): void {
      viewer = of;
      setBackground();
      listen(view, canvas, of, target, state, actions, () => help.showModal());
    },
    showProgress(share: number): void {
      bar.style.width = `${100 * share}%`;
      bar.parentElement?.setAttribute("aria-valuenow", String(Math.round(100 * share)));
    },
    showDrawn(drawn: number, total: number): void {
      drawnText.textContent =
        total === 0
          ? ""
          : drawn < total
            ? `${count(drawn)} of ${count(total)} points drawn`
            : `${count(total)} points`;
    },
    placeMarks(places): void {
      places.forEach((place, i) => {
        marks[i].hidden = place === null;
        if (place !== null) marks[i].style.transform = `translate(${place[0]}px, ${place[1]}px)`;
      });
    },
    addReport(report, setStage): void {
      inReport = true;
      document.title = report.title;
      const panel = reportPanel(report, state, actions, setStage);
      panels.push(panel);
      header.after(panel.element);
    },
    copy(link: string): void {
      history.replaceState(null, "", link);
      const copied = navigator.clipboard?.writeText(link) ?? Promise.reject(new Error("no clipboard"));
      copied.then(
        () => tell("The link is copied, and stands in the address bar."),
        () => tell("The link stands in the address bar."),
      );
    },
    update(): void {
      start.hidden = state.layer !== null || state.running !== null || inReport;
      root.classList.toggle("empty", state.layer === null);
      openButton.hidden = state.layer === null || inReport;
      progress.hidden = state.running === null;
      running.textContent = state.running ?? "";
      for (const panel of panels) panel.update();
      if (inReport)
        for (const id of ["surfaces", "curvature"]) aside.querySelector<HTMLElement>(`#${id}`)!.hidden = true;
    },
  };
}
