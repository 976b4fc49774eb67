export default {
  "video.ending": "{name} n'est pas une vidéo d'après sa terminaison ; permises : {allowed}",
  "video.times": "{name} : les temps de ses images doivent croître, un par image",
  "video.not_kept": "la vidéo de {camera} n'est pas gardée dans {take} : {error} ; libérez de la place",
  "video.decoder_broke": "le décodeur s'est arrêté sur {name} ; le fichier est-il entier ?",
  "video.no_picture": "{name} n'a pas d'image à {s:.3f} s",
  "video.no_landmarks": "aucun repère du corps de {name} n'a été enregistré",
  "video.no_solve": "sans calcul il n'y a pas de squelette à dessiner ; calculez la prise",
  "video.not_calibrated": "le calibrage utilisé ne place pas {name} : aucun squelette ne peut être dessiné sur sa vidéo",
  "video.no_lens": "le calibrage utilisé n'a pas d'objectif de {name} pour ces images : aucun squelette ne peut y être dessiné",
  "video.no_number": "la vidéo de {name} n'a pas d'image {n}",
  "video.none_kept": "la prise ne garde aucune vidéo de {name} : aucune n'a été enregistrée, elle n'est pas encore arrivée, ou elle a été supprimée",
  "video.no_token": "une vidéo ne vient qu'avec le jeton valide d'une caméra",
  "video.part_too_long": "la partie de la vidéo est plus longue qu'annoncé",
  "trash.no_video": "la prise {take} n'a pas de vidéo à jeter",
  "trash.video_has_no_place": "la prise {take} de la vidéo n'est pas là, ou a une vidéo ; restaurez la prise, ou écartez sa vidéo, d'abord",
  "trash.video_not_restored": "la vidéo de {take} ne peut être restaurée : {error}"
};
