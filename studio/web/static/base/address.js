// The studio's address for other machines, as used in commands and links for others.
const HERE = ["localhost", "127.0.0.1", "[::1]"];
const known = { address: location.origin, local: HERE.includes(location.hostname) };

/** Store the address that the server reports; see `GET /api/v1/access`. */
export function setAddress({ address, local }) {
  Object.assign(known, { address, local });
}

/** The studio's address, for people and cameras on other machines. */
export const addressForOthers = () => known.address;

/** Whether only this machine reaches that address. */
export const onlyHere = () => known.local;

/** A link for others to a path of this studio. */
export const linkTo = (path) => new URL(path, known.address).href;
