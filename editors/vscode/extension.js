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
        vscode.workspace.onDidChangeConfiguration((change) => change.affectsConfiguration("tmcl.command") && start()),
    );
    start();
}

module.exports = { activate, deactivate: () => client?.stop() };
