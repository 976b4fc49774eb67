/** Return the colour of a person on a stage of several, from the view's colours of performers. */
export const colourOf = (one, colours) => (one.number ? colours[(one.number - 1) % colours.length] : "var(--muted)");
