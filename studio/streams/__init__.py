"""Live output: the solved character sent to other programs while the stage runs.

A step of the pipeline goes to every `Sender` of `Outputs` (`sender`, `outputs`), each with its own thread, so that
the pipeline never waits for a network. The sender's encoder makes datagrams: `vmc` (VMC over OSC) or `rokoko` (JSON
v3), both in the axes of Unity (`unity`). `frames` has the messages of the WebSocket stream, in the stage frame.
A robot's joint targets have their own rate (`joint_targets`, `robot_sender`).
`targets` defines and stores the receivers; `cast` chooses the performers for each.
"""

from studio.streams.cast import Cast, Member, steps_of
from studio.streams.outputs import Outputs
from studio.streams.targets import KINDS, OutputStatus, Target

__all__ = ["KINDS", "Cast", "Member", "OutputStatus", "Outputs", "Target", "steps_of"]
