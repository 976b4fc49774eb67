/** The colour of somebody on a stage of several, of the view's colours of performers. */
export const colourOf = (one, colours) => (one.number ? colours[(one.number - 1) % colours.length] : "var(--muted)");
