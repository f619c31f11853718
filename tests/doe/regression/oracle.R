# Base R's answers to the cases in a folder: one line "case,quantity,row,value" each, 17 digits.
# A case is a CSV with y and the columns of the model t1, t2, ... but for the mean.
folder <- commandArgs(trailingOnly = TRUE)[1]
tell <- function(case, quantity, values) {
  values <- unname(values)
  cat(sprintf("%s,%s,%d,%.17g\n", case, quantity, seq_along(values), values), sep = "")
}
for (file in list.files(folder, "\\.csv$", full.names = TRUE)) {
  case <- sub("\\.csv$", "", basename(file))
  d <- read.csv(file)
  terms <- grep("^t[0-9]+$", names(d), value = TRUE)
  fit <- lm(as.formula(paste("y ~", paste(terms, collapse = " + "))), d)
  table <- coef(summary(fit))
  kept <- c("(Intercept)", terms)
  tell(case, "coefficient", table[kept, 1])
  tell(case, "standard_error", table[kept, 2])
  tell(case, "low", confint(fit)[kept, 1])
  tell(case, "high", confint(fit)[kept, 2])
  dropped <- drop1(fit, . ~ ., test = "F")
  tell(case, "ss", dropped[terms, "Sum of Sq"])
  tell(case, "f", dropped[terms, "F value"])
  tell(case, "p", dropped[terms, "Pr(>F)"])
  null <- lm(y ~ 1, d)
  tested <- anova(null, fit)
  tell(case, "model", c(tested[2, "Sum of Sq"], tested[2, "F"], tested[2, "Pr(>F)"]))
  group <- factor(do.call(paste, round(d[terms], 6)))
  lack <- anova(fit, lm(y ~ group, d))
  tell(case, "lack", c(lack[2, "Sum of Sq"], lack[2, "F"], lack[2, "Pr(>F)"]))
  missed <- sum((residuals(fit) / (1 - hatvalues(fit)))^2)
  tell(case, "press", missed)
  tell(case, "predicted_r2", 1 - missed / deviance(null))
  tell(case, "cook", cooks.distance(fit))
  tell(case, "studentised", rstudent(fit))
  tell(case, "mean_low", predict(fit, interval = "confidence")[, "lwr"])
  tell(case, "one_high", suppressWarnings(predict(fit, d, interval = "prediction"))[, "upr"])
}
