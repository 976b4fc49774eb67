"""Which USB controller a device hangs at, as Linux lists it."""

from pathlib import Path

from studio.camera.client.machine import machine_id, usb_controller


def make_usb(root: Path) -> Path:
    """Two devices at one controller (one behind a hub), a third at another; return the folder that lists them."""
    listed = root / "bus" / "usb" / "devices"
    listed.mkdir(parents=True)
    for place, serial in (
        ("pci0000:00/0000:00:14.0/usb2/2-3", "A1"),
        ("pci0000:00/0000:00:14.0/usb2/2-4/2-4.1", "B2"),
        ("pci0000:00/0000:00:1c.0/0000:03:00.0/usb4/4-1", "C3"),
    ):
        folder = root / "devices" / place
        folder.mkdir(parents=True)
        (folder / "serial").write_text(serial + "\n")
        (listed / folder.name).symlink_to(folder)
    return listed


def test_the_controller_of_a_device(tmp_path):
    listed = make_usb(tmp_path)
    assert usb_controller("A1", listed) == usb_controller("B2", listed) == "0000:00:14.0"
    assert usb_controller("C3", listed) == "0000:03:00.0"


def test_what_is_not_known(tmp_path):
    assert usb_controller("Z9", make_usb(tmp_path)) == ""
    assert usb_controller("", tmp_path) == usb_controller("A1", tmp_path / "no_such_system") == ""


def test_the_machine_is_alike_each_time():
    assert machine_id() == machine_id() and len(machine_id()) == 16
