// The studio's address as other machines reach it: what commands and links for others name.
const HERE = ["localhost", "127.0.0.1", "[::1]"];
const known = { address: location.origin, local: HERE.includes(location.hostname) };

/** Take in what the server says of its address; see `GET /api/v1/access`. */
export function setAddress({ address, local }) {
  Object.assign(known, { address, local });
}

/** The studio's address, for people and cameras on other machines. */
export const addressForOthers = () => known.address;

/** Whether no other machine reaches that address. */
export const onlyHere = () => known.local;

/** A link for others to a path of this studio. */
export const linkTo = (path) => new URL(path, known.address).href;
