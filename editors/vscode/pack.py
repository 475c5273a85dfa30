"""Packs the extension for VS Code: `python editors/vscode/pack.py [FILE]` writes dist/tmcl-VERSION.vsix.

A .vsix is a ZIP archive with a manifest.  The language client that extension.js asks for is bundled into it; npm
brings it, Node comes from where the package's own build takes it (hatch_build.py).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Final
from xml.sax.saxutils import escape, quoteattr
from zipfile import ZIP_DEFLATED, ZipFile

HERE: Final = Path(__file__).resolve().parent
ROOT: Final = HERE.parents[1]
FILES: Final = (
    "package.json",
    "README.md",
    "language-configuration.json",
    "syntaxes/tmcl.tmLanguage.json",
)
BUNDLE: Final = (
    "--bundle --minify --platform=node --format=cjs --target=node20 --external:vscode --log-level=error"
)
TYPES: Final = """\
<?xml version="1.0" encoding="utf-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
  <Default Extension=".js" ContentType="application/javascript"/>
  <Default Extension=".json" ContentType="application/json"/>
  <Default Extension=".md" ContentType="text/markdown"/>
  <Default Extension=".vsixmanifest" ContentType="text/xml"/>
</Types>
"""


def manifest(package: dict[str, Any]) -> str:
    """What the editor's gallery wants to know of the package, as it wants it."""
    identity = {key: quoteattr(package[key]) for key in ("name", "version", "publisher")}
    return f"""\
<?xml version="1.0" encoding="utf-8"?>
<PackageManifest Version="2.0.0" xmlns="http://schemas.microsoft.com/developer/vsx-schema/2011">
  <Metadata>
    <Identity Language="en-US" Id={identity["name"]} Version={identity["version"]}
              Publisher={identity["publisher"]}/>
    <DisplayName>{escape(package["displayName"])}</DisplayName>
    <Description xml:space="preserve">{escape(package["description"])}</Description>
    <Categories>{escape(",".join(package["categories"]))}</Categories>
    <Properties>
      <Property Id="Microsoft.VisualStudio.Code.Engine" Value={quoteattr(package["engines"]["vscode"])}/>
      <Property Id="Microsoft.VisualStudio.Code.ExtensionKind" Value="workspace"/>
    </Properties>
  </Metadata>
  <Installation><InstallationTarget Id="Microsoft.VisualStudio.Code"/></Installation>
  <Dependencies/>
  <Assets>
    <Asset Type="Microsoft.VisualStudio.Code.Manifest" Path="extension/package.json" Addressable="true"/>
    <Asset Type="Microsoft.VisualStudio.Services.Content.Details" Path="extension/README.md" Addressable="true"/>
  </Assets>
</PackageManifest>
"""


def bundle(main: str) -> str:
    """The extension and the language client as one script."""
    sys.path.insert(0, str(ROOT))
    from hatch_build import tools

    node, npm = tools()
    path = f"{Path(node).parent}{os.pathsep}{os.environ.get('PATH', '')}"

    def run(*command: str) -> str:
        result = subprocess.run(
            command, cwd=HERE, env={**os.environ, "PATH": path}, stdout=subprocess.PIPE, text=True, check=True
        )
        return result.stdout

    run(*npm, "ci", "--no-progress", "--loglevel=error")
    return run(str(HERE / "node_modules" / ".bin" / "esbuild"), main, *BUNDLE.split())


def pack(target: Path, package: dict[str, Any], script: str) -> None:
    """Write the archive."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with ZipFile(target, "w", ZIP_DEFLATED) as archive:
        archive.writestr("extension.vsixmanifest", manifest(package))
        archive.writestr("[Content_Types].xml", TYPES)
        archive.writestr("extension/extension.js", script)
        for name in FILES:
            archive.write(HERE / name, f"extension/{name}")


if __name__ == "__main__":
    package = json.loads((HERE / "package.json").read_text())
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "dist" / f"tmcl-{package['version']}.vsix"
    pack(file, package, bundle(package["main"]))
    sys.stdout.write(f"{file}\n")
