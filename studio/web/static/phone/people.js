// Which of several people in a picture is taken.

/** How large a person is in the picture, as a share of its width times its height. */
function sizeOf(landmarks) {
  const xs = landmarks.map(({ x }) => x), ys = landmarks.map(({ y }) => y);
  return (Math.max(...xs) - Math.min(...xs)) * (Math.max(...ys) - Math.min(...ys));
}

/** The place of the largest of several people: the nearest. */
export const nearest = (people) => people.reduce((best, one, i) => (sizeOf(one) > sizeOf(people[best]) ? i : best), 0);
