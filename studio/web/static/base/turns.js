// Requests that go out one after the other: of two that are made quickly the second one stands.

/** Return a queue: a function that runs each action after those before it, and gives what it gives. */
export function turns() {
  let last = Promise.resolve();
  return (action) => {
    last = last.catch(() => {}).then(action);
    return last;
  };
}
