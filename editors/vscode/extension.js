// Starts `tmcm34x lsp` for the editor and `tmcm34x dap` for the debugger; everything else is in there.
const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

const settings = () => vscode.workspace.getConfiguration("tmcl");

function options() {
    const { model, includePath, hints } = settings();
    return { model, includePath, hints };
}

async function start() {
    await client?.dispose();
    const command = settings().get("command");
    client = new LanguageClient(
        "tmcl",
        "TMCL",
        { command, args: ["lsp"] },
        {
            documentSelector: [{ language: "tmcl" }],
            initializationOptions: options(),
            synchronize: {
                configurationSection: "tmcl",
                fileEvents: vscode.workspace.createFileSystemWatcher("**/*.{tmc,inc}"),
            },
        },
    );
    try {
        await client.start();
    } catch {
        client = undefined;
        const change = "Change the setting tmcl.command";
        const text = `TMCL needs the command "${command}" of the Python package tmcm34x, and cannot start it.`;
        if ((await vscode.window.showErrorMessage(text, change)) === change)
            await vscode.commands.executeCommand("workbench.action.openSettings", "tmcl.command");
    }
}

// F5 in a source without a launch configuration runs that source; what the editor is set to holds for the run too.
function complete(configuration, usual) {
    if (!configuration.type) {
        if (vscode.window.activeTextEditor?.document.languageId !== "tmcl") return undefined;
        configuration = usual;
    }
    const { model, includePath } = settings();
    const more = configuration.request === "launch" && !configuration.bench ? { model } : {};
    return { ...more, include: includePath, ...configuration };
}

// The value under the menu: of a variable in the view, or what is selected in the source.
function asked(item) {
    if (item?.variable) return item.variable.evaluateName ?? item.variable.name;
    const editor = vscode.window.activeTextEditor;
    return editor?.document.getText(editor.selection).trim();
}

// The debug adapter goes back to just before the last write, and says what it was.
async function whoWrote(item) {
    const session = vscode.debug.activeDebugSession;
    const value = asked(item) || (await vscode.window.showInputBox({ prompt: "A value, such as gp[3]" }));
    if (!session || !value) return;
    try {
        const request = { expression: `who wrote ${value}?`, context: "repl" };
        const { result } = await session.customRequest("evaluate", request);
        vscode.window.showInformationMessage(`${value}: ${result}`);
    } catch (error) {
        vscode.window.showErrorMessage(error.message);
    }
}

function activate(context) {
    const [debug] = context.extension.packageJSON.contributes.debuggers;
    context.subscriptions.push(
        vscode.debug.registerDebugAdapterDescriptorFactory(debug.type, {
            createDebugAdapterDescriptor: ({ workspaceFolder }) =>
                new vscode.DebugAdapterExecutable(settings().get("command"), ["dap"], {
                    cwd: workspaceFolder?.uri.fsPath,
                }),
        }),
        vscode.debug.registerDebugConfigurationProvider(debug.type, {
            resolveDebugConfiguration: (_folder, configuration) =>
                complete(configuration, debug.initialConfigurations[0]),
        }),
        vscode.commands.registerCommand("tmcl.whoWrote", whoWrote),
        vscode.workspace.onDidChangeConfiguration((change) => change.affectsConfiguration("tmcl.command") && start()),
    );
    start();
}

module.exports = { activate, deactivate: () => client?.stop() };
