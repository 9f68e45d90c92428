"""Test the container without a container engine: run the Dockerfile's steps, and check Compose.

Each step runs in a changed root: a copy-on-write layer (overlayfs) over the files of this machine,
whose Python stands for that of the base image. `unshare` ends all processes of a step.
"""

from __future__ import annotations

import fnmatch
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from string import Template

import pytest
import yaml

from benchmarks.memory import HOSTED
from ccwsim.jobs import limits

ROOT = Path(__file__).parents[1]
DOCKERFILE = ROOT / "deploy" / "Dockerfile"
COMPOSE = yaml.safe_load((ROOT / "deploy" / "compose.yaml").read_text("utf-8"))
SERVICE = COMPOSE["services"]["dashboard"]

PYTHON = Path(sys.base_prefix, "bin")
PATH = f"{PYTHON}:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
INDEX = {name: value for name, value in os.environ.items() if re.match("PIP_|SSL_|.*_PROXY", name)}
"""Settings of this machine that `pip` needs to reach its index."""


def instructions() -> list[tuple[str, str]]:
    """Return the instructions of the Dockerfile, each with its arguments."""
    lines = DOCKERFILE.read_text("utf-8").splitlines()
    text = "\n".join(line for line in lines if not line.startswith("#"))
    steps = [line.split(None, 1) for line in text.replace("\\\n", " ").splitlines() if line]
    return [(name, arguments.strip()) for name, arguments in steps]


def arguments_of(name: str) -> list[str]:
    """Return the arguments of all instructions of a name."""
    return [arguments for each, arguments in instructions() if each == name]


def context_files() -> list[Path]:
    """Return the files that .dockerignore leaves in the build's context, relative to it."""
    rules = (ROOT / ".dockerignore").read_text("utf-8").split()
    kept = [rule[1:] for rule in rules if rule.startswith("!")]
    never = [rule for rule in rules if rule.startswith("**/")]
    assert rules[0] == "*"
    assert len(rules) == 1 + len(kept) + len(never)
    files = []
    for name in kept:
        path = ROOT / name
        files += [path] if path.is_file() else [each for each in path.rglob("*") if each.is_file()]
    relative = [file.relative_to(ROOT) for file in files]
    ignored = [rule.removeprefix("**/") for rule in never]
    return [
        file
        for file in relative
        if not any(fnmatch.fnmatch(part, rule) for part in file.parts for rule in ignored)
    ]


@dataclass
class Stage:
    """A stage of the image: a layer of files over those of the machine, and its settings."""

    folder: Path
    environment: dict[str, str] = field(default_factory=lambda: {"PATH": PATH, **INDEX})
    user: str = "0"
    workdir: str = "/"

    def __post_init__(self) -> None:
        for name in ("files", "work", "root"):
            (self.folder / name).mkdir(parents=True)
        version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
        self.run(
            f"[ -e {PYTHON}/python ] || ln -s {version} {PYTHON}/python\n"
            f"chmod a+rx {shlex.join(map(str, PYTHON.parents))}"
        )

    def run(self, script: str, *options: str, prepare: str = "", timeout: float = 1800) -> str:
        """Run a script in the root of the stage, and return its output.

        `options` are passed to `unshare`; the commands `prepare` run before the root is changed.
        """
        root = self.folder / "root"
        enter = ["chroot", f"--userspec={self.user}:{self.user}", str(root), "env", "-i"]
        enter += [f"{name}={value}" for name, value in self.environment.items()]
        enter += ["sh", "-euc", f"cd {self.workdir}\n{script}"]
        layers = f"lowerdir=/,upperdir={self.folder}/files,workdir={self.folder}/work"
        mounts = f"""
            mount -t overlay overlay -o {layers} {root}
            mount -t proc proc {root}/proc
            mount --rbind /dev {root}/dev
            {prepare}
            exec {shlex.join(enter)}
        """
        isolate = ["unshare", "--mount", "--pid", "--fork", "--kill-child", *options]
        done = subprocess.run(
            [*isolate, "sh", "-euc", mounts], capture_output=True, text=True, timeout=timeout,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
        return done.stdout

    def copy(self, source: Path, target: str) -> None:
        """Copy a file or a folder of the host into the stage."""
        path = self.folder / "files" / (self.workdir + "/" + target).lstrip("/")
        if target.startswith("/"):
            path = self.folder / "files" / target.lstrip("/")
        path = path / source.name if target.endswith("/") and source.is_file() else path
        path.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, path, symlinks=True, dirs_exist_ok=True)
        else:
            shutil.copy(source, path)


def build(folder: Path) -> tuple[Stage, list[str], list[str]]:
    """Run the steps of the Dockerfile; return the last stage, and the commands of server and check.

    Variables are replaced as the shell of Docker does, with the defaults of `ARG`.
    """
    stages: dict[str, Stage] = {}
    stage: Stage | None = None
    server: list[str] = []
    check: list[str] = []
    for name, arguments in instructions():
        if name == "FROM":
            base, _, title = arguments.partition(" AS ")
            assert base == "python:${PYTHON}"
            stage = stages[title] = Stage(folder / f"stage{len(stages)}")
            continue
        if stage is None:
            assert name == "ARG"
            continue
        if name == "RUN":
            stage.run(arguments)
        elif name == "COPY" and arguments.startswith("--from="):
            origin, source, target = arguments.removeprefix("--from=").split()
            stage.copy(stages[origin].folder / "files" / source.lstrip("/"), target)
        elif name == "COPY" and arguments == ". .":
            for file in context_files():
                stage.copy(ROOT / file, file.as_posix())
        elif name == "COPY":
            source, target = arguments.split()
            stage.copy(ROOT / source, target)
        elif name == "ENV":
            for setting in shlex.split(arguments):
                variable, _, value = setting.partition("=")
                stage.environment[variable] = Template(value).substitute(stage.environment)
        elif name == "WORKDIR":
            stage.workdir = arguments
        elif name == "USER":
            stage.user = arguments
        elif name == "CMD":
            server = json.loads(arguments)
        elif name == "HEALTHCHECK":
            check = json.loads(arguments.partition(" CMD ")[2])
        else:
            assert name == "EXPOSE", f"the test does not know the instruction {name}"
    assert stage is not None
    return stage, server, check


def can_change_root() -> bool:
    """Return whether this machine allows a changed root with a layer of files."""
    if sys.platform != "linux" or os.geteuid() != 0 or not shutil.which("unshare"):
        return False
    probe = "d=$(mktemp -d) && mkdir $d/a $d/b $d/c && mount -t overlay overlay "
    probe += "-o lowerdir=/,upperdir=$d/a,workdir=$d/b $d/c"
    tried = subprocess.run(
        ["unshare", "--mount", "--pid", "--fork", "--net", "sh", "-euc", probe], check=False,
        capture_output=True,
    )  # fmt: skip
    return tried.returncode == 0


@pytest.mark.slow
def test_the_steps_of_the_dockerfile_make_a_dashboard_that_answers(tmp_path):
    """Test the last step as in docs/server.md: read-only files except /tmp, and no network."""
    if not can_change_root():
        pytest.skip("this machine allows no changed root")
    stage, server, check = build(tmp_path)
    root = stage.folder / "root"
    script = f"""
        python -m ccwsim --version
        ! touch /app/written 2>/dev/null
        {shlex.join(server)} >/tmp/log 2>&1 &
        for _ in $(seq 240); do
            sleep 0.5
            {shlex.join(check)} 2>/tmp/refused && id -u && exit 0
        done
        cat /tmp/refused /tmp/log
        exit 1
    """
    prepare = f"""
        ip link set lo up
        mount -o remount,ro {root}
        mount -t tmpfs -o nosuid,nodev,noexec tmpfs {root}/tmp
    """
    printed = stage.run(script, "--net", prepare=prepare).split()
    assert printed[0] == "ccwsim"
    assert printed[-1] == "10001"
    kernels = stage.folder / "files" / "var" / "cache" / "ccwsim"
    assert any(kernels.rglob("*.nbi")), "no kernels were compiled"


def test_compose_runs_the_container_as_the_documents_do():
    documented = (ROOT / "docs" / "server.md").read_text("utf-8")
    (command,) = re.findall(r"docker run --rm ((?:.|\\\n)*?) ccwsim\n", documented)
    options = shlex.split(command.replace("\\\n", " "))
    flags = dict(zip(options, [*options[1:], ""], strict=True))
    assert SERVICE["ports"] == [flags["-p"]]
    assert SERVICE["read_only"] is ("--read-only" in options)
    assert SERVICE["tmpfs"] == [flags["--tmpfs"]]
    assert SERVICE["cap_drop"] == [flags["--cap-drop"]]
    assert SERVICE["security_opt"] == [flags["--security-opt"]]
    assert SERVICE["mem_limit"] == SERVICE["memswap_limit"] == flags["--memory"]
    assert SERVICE["pids_limit"] == int(flags["--pids-limit"])
    head = DOCKERFILE.read_text("utf-8").partition("ARG ")[0].replace("\n#", "\n")
    assert head.replace("\\\n", " ").split()[-len(options) - 1 : -1] == options
    assert len(SERVICE["cpuset"].split(",")) == 2  # cores that the program counts


def test_compose_builds_and_checks_the_container_as_the_dockerfile_states():
    build_of = SERVICE["build"]
    context = (ROOT / "deploy" / build_of["context"]).resolve()
    assert (context / build_of["dockerfile"]).samefile(DOCKERFILE)
    (health,) = arguments_of("HEALTHCHECK")
    times, _, command = health.partition(" CMD ")
    stated = dict(option.removeprefix("--").split("=") for option in times.split())
    check = SERVICE["healthcheck"]
    assert check["test"] == ["CMD", *json.loads(command)]
    for name, value in stated.items():
        assert str(check[name.replace("-", "_")]) == value
    assert SERVICE["ports"][0].endswith(f":{arguments_of('EXPOSE')[0]}")


def test_the_volume_of_compose_has_the_folder_of_kernels():
    (mounted,) = SERVICE["volumes"]
    volume, _, folder = mounted.partition(":")
    assert volume in COMPOSE["volumes"]
    (settings,) = arguments_of("ENV")
    environment = dict(setting.split("=", 1) for setting in shlex.split(settings))
    assert folder == f"{environment['XDG_CACHE_HOME']}/ccwsim"
    assert f"install -d -o ccwsim {folder}" in " ".join(arguments_of("RUN"))


def test_compose_passes_the_limits_of_a_server_on():
    variables = {value for name, value in vars(limits).items() if name.endswith("_VARIABLE")}
    assert SERVICE["environment"].keys() <= variables
    for name, value in SERVICE["environment"].items():
        assert value == 1 if name == limits.PROCESSES_VARIABLE else f"${{{name}:-}}", name


def test_a_hosted_demo_has_the_limits_that_were_measured():
    text = (ROOT / "docs" / "server.md").read_text("utf-8")
    (settings,) = re.findall(r"```toml\n(CCWSIM_MEMORY_MB.*?)```", text, re.DOTALL)
    assert tomllib.loads(settings) == HOSTED
    assert not (ROOT / "packages.txt").exists()
