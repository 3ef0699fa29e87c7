// Fills the report's frame with its page, which is compressed: three.js alone would be a third of the report.
"use strict";

async function fillFrame(frame, source) {
  const bytes = Uint8Array.from(atob(source.textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  frame.srcdoc = await new Response(stream).text();
}

const source = document.getElementById("page");
if (source) {
  const frame = document.querySelector("iframe.page");
  if ("DecompressionStream" in window) fillFrame(frame, source);
  else frame.replaceWith("This browser is too old to show the machine here (DecompressionStream, since 2023); the rest of the report stands.");
}
