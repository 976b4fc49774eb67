// VMC as Capture Studio sends it (OSC over UDP), read without Unity: CaptureStudioReceiver.cs shows it.
// Source: Open Sound Control 1.0; protocol.vmc.info.

using System;
using System.Collections.Generic;
using System.Text;

namespace CaptureStudio
{
    /// <summary>A bone in its parent's axes: position [m], rotation x y z w; Unity's axes, zero in the T-pose.</summary>
    public struct VmcBone
    {
        public float X, Y, Z, Qx, Qy, Qz, Qw;
    }

    /// <summary>Puts datagrams together to frames. Bones have the names of Unity's HumanBodyBones.</summary>
    public sealed class VmcReader
    {
        public readonly Dictionary<string, VmcBone> Bones = new Dictionary<string, VmcBone>();
        public string Timecode = "";
        public float TimeS;
        public int Refused;

        /// <summary>Returns whether this datagram ends a frame. One that is no OSC is counted in Refused.</summary>
        public bool Feed(byte[] packet, int length)
        {
            try
            {
                return Packet(packet, 0, length, 0);
            }
            catch (Exception error) when (error is FormatException || error is ArgumentException
                                          || error is IndexOutOfRangeException)
            {
                Refused++;
                return false;
            }
        }

        private bool Packet(byte[] data, int at, int end, int depth)
        {
            if (end - at < 8 || Text(data, at, end) != "#bundle") return Message(data, at, end);
            if (depth > 4) throw new FormatException("bundles within bundles");
            bool ended = false;
            at += 16;
            while (at < end)
            {
                int size = Int(data, at, end);
                if (size <= 0 || size > end - at - 4) throw new FormatException("a bundle that is cut");
                ended |= Packet(data, at + 4, at + 4 + size, depth + 1);
                at += 4 + size;
            }
            return ended;
        }

        private bool Message(byte[] data, int at, int end)
        {
            string address = Text(data, at, end);
            at += Padded(address);
            string types = Text(data, at, end);
            at += Padded(types);
            if (address == "/VMC/Ext/Bone/Pos" && types == ",sfffffff")
            {
                string name = Text(data, at, end);
                at += Padded(name);
                var numbers = new float[7];
                for (int k = 0; k < 7; k++) numbers[k] = Float(data, at + 4 * k, end);
                foreach (float one in numbers)
                    if (float.IsNaN(one) || float.IsInfinity(one)) throw new FormatException("not a number");
                if (Bones.Count < 128 || Bones.ContainsKey(name))
                    Bones[name] = new VmcBone
                    {
                        X = numbers[0], Y = numbers[1], Z = numbers[2],
                        Qx = numbers[3], Qy = numbers[4], Qz = numbers[5], Qw = numbers[6],
                    };
            }
            else if (address == "/studio/timecode" && types.StartsWith(",s", StringComparison.Ordinal))
                Timecode = Text(data, at, end);
            else if (address == "/VMC/Ext/T" && types == ",f")
            {
                TimeS = Float(data, at, end);
                return true;
            }
            return false;
        }

        private static int Padded(string text)
        {
            int size = Encoding.UTF8.GetByteCount(text) + 1;
            return (size + 3) / 4 * 4;
        }

        private static string Text(byte[] data, int at, int end)
        {
            int stop = at;
            while (stop < end && data[stop] != 0) stop++;
            if (stop >= end) throw new FormatException("a text that is cut");
            return Encoding.UTF8.GetString(data, at, stop - at);
        }

        private static int Int(byte[] data, int at, int end)
        {
            if (at + 4 > end) throw new FormatException("a number that is cut");
            return data[at] << 24 | data[at + 1] << 16 | data[at + 2] << 8 | data[at + 3];
        }

        private static float Float(byte[] data, int at, int end)
        {
            return BitConverter.ToSingle(BitConverter.GetBytes(Int(data, at, end)), 0);
        }
    }
}
