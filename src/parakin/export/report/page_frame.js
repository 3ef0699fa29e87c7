// Fills the frame with a page of those that are packed beside it: three.js alone would be a third of the report. Where
// the document has choices, that of the address is shown, and its page; the first one where there is none.
"use strict";

async function readPages(source) {
  const bytes = Uint8Array.from(atob(source.textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const { lines, pages } = await new Response(stream).json();
  return (number) => pages[number].map((line) => lines[line]).join("\n");
}

async function fillFrame(frame, source) {
  const writePage = await readPages(source);
  const choices = [...document.querySelectorAll("[data-choice]")];
  let shown = null;
  const show = () => {
    const chosen = Math.max(0, choices.findIndex((choice) => `#${choice.dataset.choice}` === location.hash));
    if (choices.length && !location.hash) location.replace(`#${choices[0].dataset.choice}`);
    if (chosen === shown) return;
    choices.forEach((choice, number) => { choice.hidden = number !== chosen; });
    frame.srcdoc = writePage(chosen);
    if (shown !== null) choices[chosen].scrollIntoView({ block: "nearest" });
    shown = chosen;
  };
  for (const link of document.querySelectorAll("a[data-page]")) {
    link.addEventListener("click", () => {
      link.href = URL.createObjectURL(new Blob([writePage(Number(link.dataset.page))], { type: "text/html" }));
    });
  }
  addEventListener("hashchange", show);
  show();
}

const source = document.getElementById("pages");
if (source) {
  const frame = document.querySelector("iframe.page");
  if ("DecompressionStream" in window) fillFrame(frame, source);
  else frame.replaceWith("This browser is too old to show the machine here (DecompressionStream, since 2023); the rest of the report stands.");
}
