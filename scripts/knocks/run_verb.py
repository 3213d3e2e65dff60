"""Runs a verb within limits of time and memory, and says what is wrong with how it ended."""
import re
import resource
import subprocess
from dataclasses import dataclass

ANSWERS = {0, 2, 3}  # done, bad input, no usable result
LONGEST_ERROR = 600  # characters


@dataclass
class Outcome:
    code: int
    err: str
    fault: str  # empty where the verb ended as it should


def limit(cpu_seconds, gigabytes):
    def set_limits():
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds))
        if gigabytes:
            resource.setrlimit(resource.RLIMIT_AS, (gigabytes << 30, gigabytes << 30))
    return set_limits


def run_verb(command, cpu_seconds, gigabytes):
    done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, errors="replace",
                          preexec_fn=limit(cpu_seconds, gigabytes))
    return Outcome(done.returncode, done.stderr, fault_of(done))


def fault_of(done):
    """A crash, an error that says too little, or too much, or words in spite of --quiet."""
    if done.returncode not in ANSWERS:
        return f"ended with {done.returncode}: {done.stderr.strip()[-300:]}"
    if done.stdout:
        return "--quiet wrote to standard output"
    lines = done.stderr.strip().splitlines()
    if done.returncode == 0:
        return f"--quiet wrote: {lines[0]}" if lines else ""
    if done.returncode == 2:
        return fault_of_error(lines)
    return ""


def fault_of_error(lines):
    if len(lines) != 1:
        return f"the error has {len(lines)} lines: {' / '.join(lines)[:300]}"
    line = lines[0]
    if len(line) > LONGEST_ERROR:
        return f"the error has {len(line)} characters: {line[:200]}"
    if not re.search(r": error: [^ ].*[/.][A-Za-z_]+.*: \S", line):
        return f"the error names no file: {line}"
    if any(ord(c) < 32 for c in line):
        return f"the error has control characters: {line!r}"
    return ""
