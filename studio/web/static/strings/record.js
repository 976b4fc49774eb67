export default {
  "record.title": ["Recording", "Enregistrement"],
  "record.start": ["Record", "Enregistrer"],
  "record.stop": ["Stop", "Arrêter"],
  "record.start_hint": ["Record a take (R)", "Enregistrer une prise (R)"],
  "record.stop_hint": ["Stop recording {take} (R)", "Arrêter l'enregistrement de {take} (R)"],
  "record.no_camera": ["Connect a camera to record", "Connectez une caméra pour enregistrer"],
  "record.time": ["Recording time", "Durée de l'enregistrement"],
  "record.take": ["Take", "Prise"],
  "record.automatic": ["automatic", "automatique"],
  "record.take_hint": ["Name of the next take; left empty, takes are numbered", "Nom de la prochaine prise ; vide, les prises sont numérotées"],
  "record.done": ["{take}: {seconds} s recorded", "{take} : {seconds} s enregistrées"],
  "disk.left_h": ["{hours} h left", "reste {hours} h"],
  "disk.left_min": ["{minutes} min left", "reste {minutes} min"],
  "disk.gb": ["{gb} GB", "{gb} Go"],
  "disk.label": ["Recording time left on the disk", "Durée d'enregistrement restante sur le disque"]
};
