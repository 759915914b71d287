// Pictures of scenes become the scenes themselves, drawn live, where a browser can.

function hasWebGL2() {
  return Boolean(document.createElement("canvas").getContext("webgl2"));
}

/** Put the page that a link leads to in the place of the picture that it holds. */
function bringToLife(link) {
  const picture = link.querySelector("img");
  const frame = document.createElement("iframe");
  frame.src = link.href;
  frame.title = picture.alt;
  frame.sandbox = "allow-scripts";
  frame.className = "live";
  const width = Math.min(Math.max(picture.clientWidth, 300), 420); // pixels; strips are wider
  frame.style.width = `${width}px`;
  frame.style.height = `${Math.round(width * link.dataset.aspect) + 16 * link.dataset.rows}px`;
  link.replaceWith(frame);
}

document.addEventListener("click", (event) => {
  const link = event.target.closest?.("a.live");
  if (!link || event.ctrlKey || event.metaKey || event.shiftKey || event.button !== 0 || !hasWebGL2()) return;
  event.preventDefault();
  bringToLife(link);
});
