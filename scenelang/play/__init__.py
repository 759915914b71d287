"""`scenelang play`: a local page that edits scenes and shows them. What server and page say to each other:

**Addresses.** Everything lies below ``http://127.0.0.1:PORT/TOKEN/``, so the page uses relative addresses
(``static/play.js``, ``live``, ``lsp``, ``download?key=…``) and names the token nowhere; behind an address at
the root ``?token=TOKEN`` does too. Of every request the token, the ``Host`` (a name of this machine) and the
``Origin`` are checked; a websocket must have an origin.

- ``GET ./``: ``web/play.html``, in which ``__NONCE__`` is replaced by that of its content policy: scripts
  come from ``static/`` alone, a ``<style>`` needs the nonce (of CodeMirror: ``EditorView.cspNonce``),
  pictures may be ``data:`` and ``blob:``, nothing comes from elsewhere, and the page has no ``style="…"`` and
  no inline script.
- ``GET static/NAME``: a file of ``web/``; ``static/viewer/NAME``: one of the viewer's, a module as it is
  written; ``static/examples/NAME.nsg``: a scene to start from.
- ``GET download?key=KEY``: a file that was made, once.

**A websocket of JSON texts, ``live``.** Names of files are relative to the folder, with ``/``. ``version`` is
the page's number of a text, at least 1, and grows; answers carry that of the text that they are of. ``disk``
is a digest of what the file held when it was last read or written; null where there is no file. The page
says:

- ``{kind: "open", file}``: answered by ``text``, then ``view``.
- ``{kind: "edit", file, version, text}``: the text of an open file; answered by ``view``.
- ``{kind: "save", file, version, text, base}``: write it, if the file still is as when its ``disk`` was
  ``base`` (null: there is none); answered by ``saved`` or ``conflict``.
- ``{kind: "discard", file}``: forget what was not saved. ``{kind: "close", file}``: it is not shown any more.
- ``{kind: "rename", file, to}``: answered by ``files``.
- ``{kind: "draw", id, file, params, frame, size, by}``: ``by`` is ``network``, ``reference``, ``difference``
  or ``figures``; answered by one of ``picture``, ``figures``, ``cancelled``, ``error``. ``params`` maps names
  to numbers (an angle's is in radians), booleans, vectors as lists, or texts as behind ``-D``; those left out
  have their defaults. ``size`` is ``[width, height]``, null for the scene's own.
- ``{kind: "download", id, file, as, params, frame, size}``: ``as`` is ``png``, ``gif``, ``webp``, ``apng``,
  ``html`` or ``nsg``; answered by ``progress`` …, then ``ready``.
- ``{kind: "cancel", id}``: a drawing or a download. A newer drawing by the same means cancels the older, and
  an edit cancels drawings of the text before.

The server says:

- ``{kind: "files", files, examples, folder, open, uri, most: {bytes, side}}``: at first and after changes.
  ``folder`` is its name, ``open`` the file to show first or null, ``uri`` the folder's for ``lsp``, with a
  ``/`` at its end.
- ``{kind: "text", file, text, version, disk, origin, unsaved}``: ``origin`` is ``open``, or ``disk`` where
  the file has changed there (``text`` null: it is gone). ``version`` is that of the last edit, 0 before any.
  ``unsaved`` is null or ``{text, disk, seconds}``: what was not saved when page or server ended, so long ago.
- ``{kind: "saved", file, version, disk}``: which is not told back as a ``text``.
- ``{kind: "conflict", file, version, text, disk}``: nothing was written, as the file holds ``text``; the same
  save with ``base: disk`` overwrites it.
- ``{kind: "view", file, version, view, problems: [{code, severity, message, line, column}], ms}``: ``view``
  is a text (`View.message`), null where the scene has errors, or where the last problem, a warning, says why
  no page draws it, as the network still does.
- ``{kind: "picture", id, file, version, by, png, size, ms, …}``: ``png`` in base64; ``ms`` by stage. A
  difference is three pictures in a row, with ``psnr``, ``ssim`` and ``flip``.
- ``{kind: "figures", id, file, version, model, objects, rows, canvas, ms, psnr, ssim, flip}``: null where the
  package that measures it is missing.
- ``{kind: "progress", id, done}``: of a download, in [0, 1]. ``{kind: "ready", id, url, name, bytes}``: fetch
  it.
- ``{kind: "cancelled", id}``: by a newer one, by the page or by an edit.
- ``{kind: "error", id, file, message}``: of one message of the page; ``id`` and ``file`` may be null.

**A websocket of JSON-RPC, ``lsp``**, a message a text: `scenelang lsp` in a process of its own. Addresses of
files are below ``uri``; messages with others are refused. The folder and the root of imports are the
server's, whatever ``initialize`` says.
"""
