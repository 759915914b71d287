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
  frame.style.width = `${Math.max(picture.clientWidth, 260)}px`;
  frame.style.height = `${Math.max(picture.clientWidth, 260) * (picture.naturalHeight / picture.naturalWidth)}px`;
  link.replaceWith(frame);
}

document.addEventListener("click", (event) => {
  const link = event.target.closest?.("a.live");
  if (!link || event.ctrlKey || event.metaKey || event.shiftKey || event.button !== 0 || !hasWebGL2()) return;
  event.preventDefault();
  bringToLife(link);
});

// a frame tells how high its page is
window.addEventListener("message", (event) => {
  const frame = [...document.querySelectorAll("iframe.live")].find((one) => one.contentWindow === event.source);
  const height = Number(event.data?.scenelangHeight);
  if (frame && height > 0 && height < 4000) frame.style.height = `${height}px`;
});
