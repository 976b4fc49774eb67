export default {
  "a pair from {start} to {end} s is not possible: both animations last {length} s, and 0.5 to {most} s are shown": "une paire de {start} à {end} s n'est pas possible : les deux animations durent {length} s, et 0,5 à {most} s sont montrées",
  "the two animations of a pair came out in different sizes; choose others": "les deux animations d'une paire n'ont pas la même taille ; choisissez-en d'autres",
  "neither take of a pair knows a performer; calibrate one of them first": "aucune prise d'une paire ne connaît d'interprète ; calibrez l'une d'elles d'abord",
  "pair {number} lasts {seconds} s; allowed: half a second or more": "la paire {number} dure {seconds} s ; une demi-seconde au moins est permise",
  "pair {number} has the same animation on both sides": "la paire {number} a la même animation des deux côtés",
  "a test has {n} pairs; allowed: 1 to {most}": "un test a {n} paires ; permis : 1 à {most}",
  "this test has no link; make a new one first": "ce test n'a pas de lien ; faites-en un nouveau d'abord",
  "this link leads to no test; ask who gave it to you for a new one": "ce lien ne mène à aucun test ; demandez-en un nouveau à qui vous l'a donné",
  "you have not joined this test; open the link again": "vous n'avez pas rejoint ce test ; rouvrez le lien",
  "there is no such pair in this test": "cette paire n'est pas dans ce test",
  "this test is over; thank you": "ce test est terminé ; merci",
  "this test has all the voters it needs; thank you": "ce test a tous les votants qu'il lui faut ; merci",
  "the comment has {n} characters; allowed: {most}": "le commentaire a {n} caractères ; permis : {most}",
  "the vote could not be kept: {error}; free some space and vote again": "le vote n'a pu être gardé : {error} ; libérez de la place et revotez",
  "too many requests; wait a few seconds": "trop de requêtes ; attendez quelques secondes"
};
