// What this page knows of the edits of the replayed take. `list.js` changes it.
/** The list of a take whose edits are not yet known. */
export const UNKNOWN = { revision: -1, edits: [], can_undo: false, can_redo: false, says: "" };
const state = { take: "", stamp: null, solve: "", ...UNKNOWN, cameras: [], solved: null, changed: () => {}, replay: { open: false }, sending: 0 };

/** The list: `revision`, `edits`, `can_undo`, `can_redo`, `says`; the take's `cameras`; `solved`, the replayed solve's report on its edits. */
export const editList = () => state;
