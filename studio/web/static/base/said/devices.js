export default {
  "device.simulated_depth": "caméra de profondeur simulée {number}",
  "device.openni": "caméra OpenNI {number}",
  "device.none": "il n'y a pas d'appareil {id}",
  "device.name": "le nom de caméra « {name} » n'est pas permis ; permis : 1 à 63 lettres, chiffres, `_`, `.`, `-`, en commençant par une lettre ou un chiffre",
  "device.in_use": "la caméra « {name} » utilise cet appareil ; arrêtez-la d'abord",
  "device.client_ended": "son client s'est terminé (code {code}) ; connectez-le de nouveau",
  "device.search_broke_off": "source {kind} : sa bibliothèque s'est interrompue ou n'a pas répondu ; rebranchez ses appareils, ou lancez-en un par la commande",
  "device.no_sdk": "source {kind} : son SDK ne répond pas ({error}) ; {install}",
  "device.kinect_v2_unlisted": "le SDK Kinect 2.0 ne dit pas si une Kinect v2 est branchée ; lancez-la par la commande",
  "device.webcams_unlisted": "les webcams ne sont listées que sous Linux ; lancez-en une par la commande",
  "device.webcam_model": "les webcams ont besoin d'un pose landmarker de MediaPipe : lancez le studio avec son fichier dans {variable}",
  "picture.none": "{device} ne donne pas d'image : rebranchez-le, ou fermez ce qui l'utilise",
  "picture.skeletons": "{device} donne des squelettes et pas d'images",
  "picture.broke_off": "la bibliothèque de l'appareil s'est interrompue ou n'a rien donné ; rebranchez l'appareil",
  "picture.recording": "aucune image n'est prise pendant l'enregistrement d'une prise ; arrêtez-le d'abord",
  "picture.not_taken": "aucune image de cet appareil n'a encore été prise"
};
