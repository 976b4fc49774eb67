// Inside the 3D view, before its own program: shows the mannequin's body that is chosen in this browser. The server sends the
// bones of the first body only; here the chosen one gets them. Bodies are nodes `.../bodies/NAME`.
(() => {
  const KEPT = "body"; // as body.js keeps it, for this browser
  const NODE = /^(.+\/bodies)\/(\w+)$/, SKIN = /^(.+\/bodies)\/(\w+)(\/\d+)$/;
  const BONES = ["SetBonePositionMessage", "SetBoneOrientationMessage"];
  const nodes = new Map(); // a body's node -> its name
  const bones = new Map(); // a skin of the body whose bones are sent -> its newest messages, by kind and bone
  let worker = null;
  let chosen = localStorage.getItem(KEPT) ?? "standard";

  function bone(message) {
    const [, place, , tone] = message.name.match(SKIN) ?? [];
    if (!place) return;
    if (!bones.has(message.name)) bones.set(message.name, new Map());
    bones.get(message.name).set(`${message.type} ${message.bone_index}`, { ...message });
    message.name = `${place}/${chosen}${tone}`;
  }

  function hear({ data }) {
    for (const message of data.type === "message_batch" ? data.messages : []) {
      if (BONES.includes(message.type)) bone(message);
      else if (message.type === "SetSceneNodeVisibilityMessage" && NODE.test(message.name)) {
        const [, , name] = message.name.match(NODE);
        nodes.set(message.name, name);
        message.visible = name === chosen;
      } else if (message.type === "RemoveSceneNodeMessage") bones.delete(message.name);
    }
  }

  window.Worker = class extends Worker {
    constructor(...how) {
      super(...how);
      worker = this;
      this.addEventListener("message", hear);
    }
  };

  window.addEventListener("storage", ({ key, newValue }) => {
    if (key !== KEPT || !newValue || newValue === chosen) return;
    chosen = newValue;
    const messages = [...nodes.keys()].map((name) => ({ type: "SetSceneNodeVisibilityMessage", name, visible: true, owner: "" }));
    for (const newest of bones.values()) messages.push(...[...newest.values()].map((message) => ({ ...message })));
    worker?.dispatchEvent(new MessageEvent("message", { data: { type: "message_batch", messages } }));
  });
})();
