// Requests sent one after the other: of two made in quick succession, the second prevails.

/** Return a queue: a function that runs each action after those before it, and returns its result. */
export function turns() {
  let last = Promise.resolve();
  return (action) => {
    last = last.catch(() => {}).then(action);
    return last;
  };
}
