"""Solves camera frames as they come over a socket, one JSON line a frame.

A second process plays a take's frames in the order of their times, as cameras would send them; put your own cameras
in its place. Device times are brought to the stage clock by each camera's clock in the calibration.

    python examples/live_from_socket.py TAKE
"""

import json
import socket
import sys
from multiprocessing import Process

import numpy as np

import studio


def send(take_path: str, port: int) -> None:
    """Play a take's frames into a socket."""
    take = studio.open_take(take_path)
    clocks = {name: camera.clock for name, camera in take.calibration().cameras.items()}
    frames = [frame for camera in studio.camera_frames(take.raw_path).values() for frame in camera]
    frames.sort(key=lambda frame: clocks[frame.camera].stage_ns(frame.device_time_ns))
    with socket.create_connection(("127.0.0.1", port)) as connection, connection.makefile("w") as lines:
        for frame in frames:
            line = {
                "camera": frame.camera,
                "sequence": frame.sequence,
                "device_time_ns": frame.device_time_ns,
                "positions": frame.positions.tolist(),  # NaN = unseen
                "confidence": frame.confidence.tolist(),
            }
            lines.write(json.dumps(line) + "\n")


def read(line: str) -> studio.CameraFrame:
    """Return the frame of a line."""
    value = json.loads(line)
    positions, confidence = np.array(value.pop("positions")), np.array(value.pop("confidence"))
    return studio.CameraFrame(**value, positions=positions, confidence=confidence)


def main(take_path: str) -> None:
    calibration = studio.open_take(take_path).calibration()
    stream = studio.Stream(calibration, studio.settings("studio"))
    with socket.create_server(("127.0.0.1", 0)) as server:
        sender = Process(target=send, args=(take_path, server.getsockname()[1]))
        sender.start()
        connection, _ = server.accept()
        head, frames, poses = studio.OUTPUT_JOINTS.index("Head"), 0, 0
        with connection, connection.makefile() as lines:
            for line in lines:
                frames += 1
                for result in stream.add(read(line)):
                    poses += 1
                    if poses % 300 == 0:
                        x, y, z = result.positions_m[head]
                        time_s = result.frame_set.stage_time_ns * 1e-9
                        print(f"{time_s:7.2f} s: head at {x:.2f}, {y:.2f}, {z:.2f} m")
        poses += len(stream.rest())
        sender.join()
    print(f"{frames} frames, {poses} poses")


if __name__ == "__main__":
    main(sys.argv[1])
