// Starts `tmcm34x lsp` for the editor and `tmcm34x dap` for the debugger; everything else is in there.
const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

const settings = () => vscode.workspace.getConfiguration("tmcl");

function options() {
    const { model, includePath, hints } = settings();
    return { model, includePath, hints };
}

async function activate(context) {
    const command = settings().get("command");
    client = new LanguageClient(
        "tmcl",
        "TMCL",
        { command, args: ["lsp", "--stdio"] },
        {
            documentSelector: [{ language: "tmcl" }],
            initializationOptions: options(),
            synchronize: {
                configurationSection: "tmcl",
                fileEvents: vscode.workspace.createFileSystemWatcher("**/*.{tmc,inc}"),
            },
        },
    );
    context.subscriptions.push(
        vscode.debug.registerDebugAdapterDescriptorFactory("tmcl", {
            createDebugAdapterDescriptor: () => new vscode.DebugAdapterExecutable(settings().get("command"), ["dap"]),
        }),
        vscode.debug.registerDebugConfigurationProvider("tmcl", {
            // F5 in a source without a launch configuration runs that source.
            resolveDebugConfiguration: (_folder, configuration) =>
                configuration.type
                    ? configuration
                    : { type: "tmcl", request: "launch", name: "TMCL", program: "${file}" },
        }),
    );
    await client.start();
}

module.exports = { activate, deactivate: () => client?.stop() };
