export default {
  "shared.loading": ["Loading", "Chargement"],
  "shared.play": ["Play (Space)", "Lire (Espace)"],
  "shared.pause": ["Pause (Space)", "Pause (Espace)"],
  "shared.back": ["A frame back (←)", "Une image en arrière (←)"],
  "shared.on": ["A frame on (→)", "Une image en avant (→)"],
  "shared.time": ["Time", "Temps"],
  "shared.speed": ["Speed", "Vitesse"],
  "shared.loop": ["Loop", "Boucle"],
  "shared.loop_hint": ["Begin again at the end (L)", "Reprendre au début une fois à la fin (L)"],
  "shared.follow": ["Follow", "Suivre"],
  "shared.follow_hint": ["Go along with the performer (F)", "Accompagner l'interprète (F)"],
  "shared.stage": ["3D replay: drag to turn, scroll to come nearer", "Animation 3D : glisser pour tourner, molette pour s'approcher"],
};
