"""Live output: the solved character sent to other programs while the stage runs.

A step of the pipeline goes to every `Sender` of `Outputs` (`sender`, `outputs`), a thread each, so that the pipeline
never waits for a network. The sender's encoder makes datagrams of it: `vmc` (VMC over OSC) or `rokoko` (JSON v3),
both in the axes of Unity (`unity`). `frames` has the messages of the WebSocket stream, in the stage frame.
`targets` says what can be sent where, and keeps it.
"""

from studio.streams.outputs import Outputs
from studio.streams.targets import KINDS, Target

__all__ = ["KINDS", "Outputs", "Target"]
