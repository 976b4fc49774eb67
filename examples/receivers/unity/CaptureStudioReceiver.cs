// Unity shows the live character of Capture Studio: add this to a model with a humanoid Avatar, in its T-pose.
// Add an output of the kind `vmc` in the studio, with this machine's address and the port below. Where the model is
// of another size, the output's `scale` is its height over the performer's.

using System.Collections.Generic;
using System.Net;
using System.Net.Sockets;
using UnityEngine;

namespace CaptureStudio
{
    [RequireComponent(typeof(Animator))]
    public sealed class CaptureStudioReceiver : MonoBehaviour
    {
        [Tooltip("UDP port of the studio's vmc output")]
        public int port = 39539;
        [Tooltip("Off: only programs on this machine are heard")]
        public bool otherMachines = false;

        private readonly VmcReader reader = new VmcReader();
        private readonly Dictionary<HumanBodyBones, Quaternion> rest = new Dictionary<HumanBodyBones, Quaternion>();
        private readonly byte[] buffer = new byte[65536];
        private Animator animator;
        private Socket channel;

        private void OnEnable()
        {
            animator = GetComponent<Animator>();
            Quaternion back = Quaternion.Inverse(transform.rotation);
            for (var bone = HumanBodyBones.Hips; bone < HumanBodyBones.LastBone; bone++)
            {
                Transform part = animator.GetBoneTransform(bone);
                if (part != null && !rest.ContainsKey(bone)) rest[bone] = back * part.rotation;
            }
            channel = new Socket(AddressFamily.InterNetwork, SocketType.Dgram, ProtocolType.Udp) { Blocking = false };
            channel.Bind(new IPEndPoint(otherMachines ? IPAddress.Any : IPAddress.Loopback, port));
        }

        private void OnDisable()
        {
            channel?.Close();
            channel = null;
        }

        private void LateUpdate()
        {
            bool ended = false;
            while (channel != null && channel.Available > 0)
                ended |= reader.Feed(buffer, channel.Receive(buffer));
            if (ended) Show();
        }

        // Rotations come in the parent's axes and are zero in the T-pose: they are put together from the hips on,
        // and each turns its bone from the rest that the model has.
        private void Show()
        {
            var world = new Dictionary<string, Quaternion>();
            foreach (HumanBodyBones bone in Order.Bones)
            {
                if (!reader.Bones.TryGetValue(bone.ToString(), out VmcBone said)) continue;
                string parent = Order.ParentOf(bone);
                Quaternion above = parent != "" && world.TryGetValue(parent, out Quaternion found)
                    ? found : Quaternion.identity;
                Quaternion turned = above * new Quaternion(said.Qx, said.Qy, said.Qz, said.Qw);
                world[bone.ToString()] = turned;
                Transform part = animator.GetBoneTransform(bone);
                if (part == null || !rest.TryGetValue(bone, out Quaternion atRest)) continue;
                part.rotation = transform.rotation * turned * atRest;
                if (bone == HumanBodyBones.Hips)
                    part.position = transform.TransformPoint(new Vector3(said.X, said.Y, said.Z));
            }
        }

        private static class Order
        {
            public static readonly List<HumanBodyBones> Bones = new List<HumanBodyBones>();
            private static readonly Dictionary<HumanBodyBones, string> Parents = new Dictionary<HumanBodyBones, string>();

            static Order()
            {
                string[] trunk = { "Hips", "Spine", "Chest", "UpperChest", "Neck", "Head" };
                for (int k = 0; k < trunk.Length; k++) Add(trunk[k], k == 0 ? "" : trunk[k - 1]);
                foreach (string side in new[] { "Left", "Right" })
                {
                    Chain(side, "UpperChest", "Shoulder", "UpperArm", "LowerArm", "Hand");
                    Chain(side, "Hips", "UpperLeg", "LowerLeg", "Foot", "Toes");
                    foreach (string finger in new[] { "Thumb", "Index", "Middle", "Ring", "Little" })
                        Chain(side, side + "Hand", finger + "Proximal", finger + "Intermediate", finger + "Distal");
                }
            }

            private static void Chain(string side, string parent, params string[] parts)
            {
                foreach (string part in parts)
                {
                    Add(side + part, parent);
                    parent = side + part;
                }
            }

            private static void Add(string name, string parent)
            {
                var bone = (HumanBodyBones)System.Enum.Parse(typeof(HumanBodyBones), name);
                Bones.Add(bone);
                Parents[bone] = parent;
            }

            public static string ParentOf(HumanBodyBones bone)
            {
                return Parents[bone];
            }
        }
    }
}
