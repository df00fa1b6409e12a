### Errors of the screen

error-no_screen = The configuration has no table [screen].
    .remedy = Add [screen].
error-app_cannot_listen = The app cannot listen: { $cause }.
    .remedy = End the other program, which may be another thermaxis app, or state another port, with --port; 0 takes any that is free.
error-screen_cannot_listen = The screen cannot listen: { $cause }.
    .remedy = Take another port, or end the program that has it.
