/* The page's script is packed; it is unpacked here, and put in as it is: the policy knows its digest. */
(async () => {
  const note = document.getElementById("note");
  const still = (why) => {
    note.textContent = `A still picture: ${why}.`;
    note.hidden = false;
  };
  for (const trouble of ["error", "unhandledrejection"]) {
    addEventListener(trouble, () => still("this browser does not run the page"));
  }
  if (!self.DecompressionStream) {
    still("this browser cannot unpack the page");
    return;
  }
  const bytes = Uint8Array.from(atob(document.getElementById("code").textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const script = document.createElement("script");
  script.type = "module";
  script.textContent = await new Response(stream).text();
  document.body.append(script);
})();
