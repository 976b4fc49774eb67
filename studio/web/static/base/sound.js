// Sounds to be heard from three metres away: synthesised here, no files; the choice to mute them is kept.
const KEPT = "muted";
const TONES = { // frequency [Hz], begin and length [s]
  tick: [[880, 0, 0.07]],
  go: [[1320, 0, 0.22]],
  step: [[660, 0, 0.09], [880, 0.1, 0.12]],
  success: [[660, 0, 0.13], [880, 0.14, 0.13], [1320, 0.28, 0.32]],
  refusal: [[330, 0, 0.22], [247, 0.24, 0.4]],
};
const LOUDNESS = 0.25;
const EDGE_S = 0.012; // no clicks at the ends

let context = null;

/** Whether sounds are off. */
export const isMuted = () => localStorage.getItem(KEPT) === "yes";

/** Turn sounds off or on, and keep the choice. */
export const setMuted = (muted) => localStorage.setItem(KEPT, muted ? "yes" : "no");

/** Play a sound: one of tick, go, step, success, refusal. Silent before the first user action (browser rule). */
export function play(name) {
  if (isMuted() || navigator.userActivation?.hasBeenActive === false) return;
  context ??= new AudioContext();
  if (context.state === "suspended") context.resume();
  for (const [frequency, begin, length] of TONES[name]) {
    const at = context.currentTime + begin;
    const tone = new OscillatorNode(context, { type: "triangle", frequency });
    const gain = new GainNode(context, { gain: 0 });
    gain.gain.setValueAtTime(0, at);
    gain.gain.linearRampToValueAtTime(LOUDNESS, at + EDGE_S);
    gain.gain.setValueAtTime(LOUDNESS, at + length - EDGE_S);
    gain.gain.linearRampToValueAtTime(0, at + length);
    tone.connect(gain).connect(context.destination);
    tone.start(at);
    tone.stop(at + length);
  }
  document.body.dataset.sound = name;
}
