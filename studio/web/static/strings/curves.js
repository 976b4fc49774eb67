export default {
  "trial.progress": ["Solving with these switches", "Calcul avec ces réglages"],
  "trial.solving": ["Solving with these switches", "Calcul avec ces réglages"],
  "trial.draft": ["First look, without finishing", "Premier aperçu, sans la finition"],
};
