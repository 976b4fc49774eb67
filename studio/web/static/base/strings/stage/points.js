export default {
  "layer.points": [null, "Nuages de points"],
  "layer_help.points": ["What the depth cameras see, as points", "Ce que voient les caméras de profondeur, en points"],
  "points.group": ["Colour and cameras of the points", "Couleur et caméras des points"],
  "points.by.camera": ["Colour by camera", "Couleur par caméra"],
  "points.by.confidence": ["Colour by confidence", "Couleur par confiance"],
  "points.count": ["{n} points", "{n} points"],
  "points.figures": ["{count} · {fps} fps · {rate} MB/s", "{count} · {fps} i/s · {rate} Mo/s"],
  "points.hint": ["Points of the take's depth at the playhead: how many, how often and how much of them this browser gets. They are thinned to 20 pictures a second and 2.2 MB a second at most, which a tablet takes. Confidence is that of the nearest joint of the solve; grey: no joint is near, or there is no solve.", "Points de la profondeur de la prise à la tête de lecture : combien, à quel rythme et quel débit reçoit ce navigateur. Ils sont réduits à 20 images et 2,2 Mo par seconde au plus, ce que supporte une tablette. La confiance est celle de l'articulation calculée la plus proche ; gris : aucune n'est proche, ou il n'y a pas de calcul."],
  "points.hint_live": ["Points of what the depth cameras send: how many, how often and how much of them this browser gets. Cameras find the skeleton themselves and send small depth images, 20 a second; whole ones come while a take is recorded with depth (--record-depth). Thinned to 20 pictures a second and 2.2 MB a second at most, which a tablet takes.", "Points de ce qu'envoient les caméras de profondeur : combien, à quel rythme et quel débit reçoit ce navigateur. Les caméras trouvent elles-mêmes le squelette et envoient de petites images de profondeur, 20 par seconde ; les images entières viennent pendant qu'une prise est enregistrée avec la profondeur (--record-depth). Réduits à 20 images et 2,2 Mo par seconde au plus, ce que supporte une tablette."],
  "points.reading": ["Reading the take's depth", "Lecture de la profondeur de la prise"],
  "points.unreadable": ["The take's depth cannot be read", "La profondeur de la prise est illisible"],
  "points.none_in_take": ["This take has no depth", "Cette prise n'a pas de profondeur"],
  "points.none_live": ["No camera sends depth", "Aucune caméra n'envoie de profondeur"],
  "points.no_place": ["{camera}: its place is not calibrated", "{camera} : sa place n'est pas calibrée"],
  "points.no_image": ["{camera}: no depth image now", "{camera} : aucune image de profondeur à cet instant"],
  "points.damaged": ["{camera}: the depth image is damaged", "{camera} : l'image de profondeur est abîmée"]
};
