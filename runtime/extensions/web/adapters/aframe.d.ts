/**
 * Registers with A-Frame, which is loaded before: `<a-scene modar="src: museum.modar">` and `<a-entity modar-print="cover">`, with
 * the events modarready, modarerror, printfound and printlost; and what pages of MindAR and of 8th Wall's image targets have.
 */
export {};
