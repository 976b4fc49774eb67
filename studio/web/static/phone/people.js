// Choice of one of several people in a picture.

/** Area of a person's bounding box, as a share of the picture's. */
function sizeOf(landmarks) {
  const xs = landmarks.map(({ x }) => x), ys = landmarks.map(({ y }) => y);
  return (Math.max(...xs) - Math.min(...xs)) * (Math.max(...ys) - Math.min(...ys));
}

/** Index of the largest of several people, taken as the nearest. */
export const nearest = (people) => people.reduce((best, one, i) => (sizeOf(one) > sizeOf(people[best]) ? i : best), 0);
