// Dropped or chosen files as a list with their paths; folders are walked through.

const CLUTTER = ["thumbs.db", "desktop.ini", "__macosx"]; // of the systems; nothing that a recording is made of

const isWanted = ({ path, file }) => file && path.split("/").every((part) => !part.startsWith(".") && !CLUTTER.includes(part.toLowerCase()));

const fileOf = (entry) => new Promise((resolve, reject) => entry.file(resolve, reject));

/** Return all entries of a folder: a browser returns a hundred at a time. */
async function entriesOf(folder) {
  const reader = folder.createReader(), found = [];
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) return found;
    found.push(...some);
  }
}

async function walk(entry, path) {
  if (entry.isFile) return [{ path, file: await fileOf(entry) }];
  const found = [];
  for (const one of await entriesOf(entry)) found.push(...await walk(one, `${path}/${one.name}`));
  return found;
}

/** Return the dropped files as `[{path, file}]`; to be called at once, as the browser forgets what was dropped. */
export async function droppedFiles(transfer) {
  const items = [...transfer.items].filter((item) => item.kind === "file").map((item) => ({ entry: item.webkitGetAsEntry?.(), file: item.getAsFile() }));
  const found = [];
  for (const { entry, file } of items) found.push(...(entry ? await walk(entry, entry.name) : [{ path: file?.name ?? "", file }]));
  return found.filter(isWanted);
}

/** Return the files of a file field, as `[{path, file}]`. */
export const chosenFiles = (field) => [...field.files].map((file) => ({ path: file.webkitRelativePath || file.name, file })).filter(isWanted);
