// Starts `scenelang lsp` and talks to it; everything else about the language is the server's.
const { existsSync } = require("node:fs");
const { spawnSync } = require("node:child_process");
const path = require("node:path");
const vscode = require("vscode");
const { LanguageClient, RevealOutputChannelOn, State, Trace } = require("vscode-languageclient/node");

const DOCUMENTS = [
  { scheme: "file", language: "nsg" },
  { scheme: "untitled", language: "nsg" },
];
const INSTALL = "pip install 'scenelang[lsp]'";

let client;
let channel;

/** The program to run: the setting, the workspace's virtual environment, or what the PATH has. */
function program() {
  const chosen = vscode.workspace.getConfiguration("scenelang").get("path", "").trim();
  const folders = (vscode.workspace.workspaceFolders ?? []).filter((folder) => folder.uri.scheme === "file");
  const home = process.env.HOME ?? process.env.USERPROFILE ?? "";
  if (chosen) {
    const expanded = chosen.replace(/^~(?=[\\/])/, home);
    const inside = folders[0] && expanded.includes("/") && path.resolve(folders[0].uri.fsPath, expanded);
    return inside || expanded;
  }
  // A folder of strangers must not choose what runs.
  if (vscode.workspace.isTrusted) {
    const parts = process.platform === "win32" ? ["Scripts", "scenelang.exe"] : ["bin", "scenelang"];
    for (const folder of folders) {
      for (const environment of [".venv", "venv"]) {
        const found = path.join(folder.uri.fsPath, environment, ...parts);
        if (existsSync(found)) return found;
      }
    }
  }
  return "scenelang";
}

/** What is wrong with a program, or nothing. */
function trouble(command) {
  const done = spawnSync(command, ["lsp", "--help"], { encoding: "utf8", timeout: 20000 });
  if (done.error) return `cannot run \`${command}\` (${done.error.code ?? done.error.message})`;
  return done.status === 0 ? undefined : `\`${command} lsp\` fails: ${(done.stderr || "").trim().split("\n").pop()}`;
}

async function start() {
  const command = program();
  const wrong = trouble(command);
  if (wrong) {
    channel.appendLine(wrong);
    const answer = await vscode.window.showErrorMessage(
      `scenelang: ${wrong}. Install it with ${INSTALL}, or set where it is.`,
      "Open Settings",
    );
    if (answer) await vscode.commands.executeCommand("workbench.action.openSettings", "scenelang.path");
    return;
  }
  const started = new LanguageClient(
    "scenelang",
    "scenelang",
    { command, args: ["lsp", "--stdio"] },
    {
      documentSelector: DOCUMENTS,
      initializationOptions: options(),
      outputChannel: channel,
      revealOutputChannelOn: RevealOutputChannelOn.Never,
    },
  );
  client = started;
  await started.start();
  await started.setTrace(Trace.fromString(vscode.workspace.getConfiguration("scenelang").get("trace.server", "off")));
}

/** The settings that the server reads; an empty text is none. */
function options() {
  const settings = vscode.workspace.getConfiguration("scenelang");
  return {
    scenelang: {
      model: settings.get("model") || null,
      root: settings.get("root") || null,
      debounceMs: settings.get("debounceMs"),
      inlayHints: { values: settings.get("inlayHints.values"), arguments: settings.get("inlayHints.arguments") },
    },
  };
}

async function stop() {
  const running = client;
  client = undefined;
  if (running?.state === State.Running) await running.stop();
  else await running?.dispose();
}

async function restart() {
  await stop();
  await start();
}

async function changed(event) {
  if (!event.affectsConfiguration("scenelang")) return;
  if (event.affectsConfiguration("scenelang.path") || client?.state !== State.Running) return restart();
  await client.setTrace(Trace.fromString(vscode.workspace.getConfiguration("scenelang").get("trace.server", "off")));
  await client.sendNotification("workspace/didChangeConfiguration", { settings: options() });
}

async function activate(context) {
  channel = vscode.window.createOutputChannel("scenelang");
  context.subscriptions.push(
    channel,
    vscode.commands.registerCommand("scenelang.restart", restart),
    vscode.commands.registerCommand("scenelang.log", () => channel.show()),
    vscode.workspace.onDidChangeConfiguration(changed),
    vscode.workspace.onDidGrantWorkspaceTrust(restart),
  );
  await start();
}

module.exports = { activate, deactivate: stop };
